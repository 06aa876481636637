"""The electrical side: volts into force, elongation into volts; amplifier, wires and converters."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from checks.arrays import Array, Complex
from checks.model.parameters import si

PICKUP_TO_HZ = 100e3  # a derivative without an end has no path in time; far above every band


@dataclass(frozen=True)
class Electrical:
    """Converters, amplifier and sensor circuit. gain: volts on the stacks per volt of Va; ga [N/V] force pair on the
    actuator stacks per volt on them; gs [V/m] sensor voltage per elongation of the sensor stack; amplifier_Hz: its
    bandwidth, infinite for none; highpass_Hz: of the sensor stack and its resistor; crosstalk [V/V] of the amplifier's
    output into Vs, pickup [s] of its derivative, by a return wire that both share; tau [s] delay; second_order,
    charge_highpass: corner [Hz] and damping ratio of an amplifier and of a charge amplifier's high-pass of second
    order, off at an infinite corner and at one of zero."""

    gain: float
    ga: float
    gs: float
    amplifier_Hz: float
    highpass_Hz: float
    crosstalk: float
    pickup: float
    tau: float
    second_order: tuple[float, float]
    charge_highpass: tuple[float, float]

    def coupling(self, f: Array) -> Complex:
        """Return the share (F,) of the amplifier's output that couples into Vs: a constant, and its derivative up to
        `PICKUP_TO_HZ`."""
        s = 2j * np.pi * f
        return np.asarray(self.crosstalk + self.pickup * s / (1.0 + 1j * f / PICKUP_TO_HZ))

    def drive(self, f: Array) -> Complex:
        """Return the factor (F,) of delay and amplifier on every output: exp(-s tau) / (1 + s / w), and w^2 / (s^2 + 2
        z w s + w^2) for an amplifier of second order."""
        factor: Complex = np.exp(-2j * np.pi * f * self.tau) / (1.0 + 1j * f / self.amplifier_Hz)
        corner_Hz, damping_ratio = self.second_order
        if np.isfinite(corner_Hz):
            x = 1j * f / corner_Hz
            factor /= 1.0 + 2.0 * damping_ratio * x + x * x
        return factor

    def sensor(self, f: Array) -> Complex:
        """Return the high-pass (F,) of the sensor's capacitance and resistor, s / (s + w), and that of a charge
        amplifier, s^2 / (s^2 + 2 z w s + w^2); one without either."""
        factor = np.ones(f.shape, dtype=complex)
        if self.highpass_Hz != 0.0:
            factor = 1j * f / (1j * f + self.highpass_Hz)
        corner_Hz, damping_ratio = self.charge_highpass
        if corner_Hz != 0.0:
            x = 1j * f
            factor = factor * x * x / (x * x + 2.0 * damping_ratio * corner_Hz * x + corner_Hz**2)
        return factor


def electrical_of(v: Mapping[str, float]) -> Electrical:
    """Return the converters, amplifier and sensor circuit that a model's values describe."""
    if "constants.gs_V_per_N" in v:  # the sensor stack reads a force
        gs = v["constants.gs_V_per_N"] * si(v, "apa.ke_N_per_um")
    else:
        gs = v["constants.gs_V_per_m"]
    return Electrical(
        gain=v["constants.amplifier_gain"],
        ga=v["constants.ga_N_per_V"],
        gs=gs,
        amplifier_Hz=v["amplifier.f_Hz"],
        highpass_Hz=v["sensor.highpass_Hz"],
        crosstalk=v["sensor.crosstalk_V_per_V"],
        pickup=si(v, "sensor.pickup_us"),
        tau=si(v, "delay.tau_us"),
        second_order=(v["amplifier.second_order_Hz"], v["amplifier.second_order_damping_ratio"]),
        charge_highpass=(v["sensor.charge_highpass_Hz"], v["sensor.charge_highpass_damping_ratio"]),
    )


def highpass_corner(resistor_ohm: float, capacitance_F: float) -> float:
    """Return the corner [Hz] of a stack of this capacitance on this resistor: 1 / (2 pi R C) ([STB] 3.1.9)."""
    return 1.0 / (2.0 * np.pi * resistor_ohm * capacitance_F)
