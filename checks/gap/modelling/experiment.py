"""Measurements that distinguish explanations: the menu of [GAP] 11, in the order in which they are requested."""

from collections.abc import Iterable
from enum import Enum


class Experiment(Enum):
    """An experiment at the bench, in words. The sharpest and least troublesome comes first."""

    MASS = "repeat with +0.5 kg on the payload: an added mass moves what depends on the payload, nothing else"
    UNPLUG = "unplug the sensor stack at the amplifier and record Vs: what is left is cross-talk"
    OWN_RETURN = "repeat with a return wire of its own for the sensor stack: what a shared one adds to Vs is then gone"
    TURN = "turn the strut by 180 degrees about its axis: what is the strut's stays what it is, the bench's changes"
    LEVEL = "repeat at half the drive level: what is linear stays, hysteresis and saturation change"
    LOOP_BACK = "feed Va to each channel's converter in turn: its latency and its filter show without the strut"
    RESISTOR = "repeat with another resistor across the sensor stack: only the sensor's high-pass moves"
    POINT = "read a second point with the interferometer: a mode of the bench shows there, one of the encoder does not"
    DUMMY = "drive a dummy capacitor and read it back: amplifier, converters and delay without the strut"
    BARE = "record without the encoder: its mass, scale and bracket are then gone"


def sharpest(experiments: Iterable[Experiment]) -> Experiment:
    """Return the experiment to do first of those that several effects ask for."""
    order = list(Experiment)
    return min(experiments, key=order.index, default=Experiment.LEVEL)
