"""The electrical side: volts into force, elongation into volts, and what amplifier, wires and converters do to them."""

from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex


@dataclass(frozen=True)
class Electrical:
    """gain: volts on the stacks per volt of Va; ga [N/V] force pair on the actuator stacks per volt on them;
    gs [V/m] sensor voltage per elongation of the sensor stack; amplifier_Hz: its bandwidth, infinite for none;
    highpass_Hz: of the sensor stack and its resistor; crosstalk [V/V] of the amplifier's output into Vs; tau [s] delay.
    """

    gain: float
    ga: float
    gs: float
    amplifier_Hz: float = np.inf
    highpass_Hz: float = 0.0
    crosstalk: float = 0.0
    tau: float = 0.0

    def drive(self, f: Array) -> Complex:
        """(F,) what delay and amplifier do to every output: exp(-s tau) / (1 + s / w)."""
        factor: Complex = np.exp(-2j * np.pi * f * self.tau) / (1.0 + 1j * f / self.amplifier_Hz)
        return factor

    def sensor(self, f: Array) -> Complex:
        """(F,) high-pass s / (s + w) of the sensor's capacitance and resistor; one without."""
        if self.highpass_Hz == 0.0:
            return np.ones(f.shape, dtype=complex)
        return 1j * f / (1j * f + self.highpass_Hz)


def highpass_corner(resistor_ohm: float, capacitance_F: float) -> float:
    """Corner [Hz] of a stack of this capacitance on this resistor: 1 / (2 pi R C) ([STB] 3.1.9)."""
    return 1.0 / (2.0 * np.pi * resistor_ohm * capacitance_F)
