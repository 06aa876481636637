"""What a quantity is called where people read it; its code name is for files and for detail."""

import re

from specs.units import without_unit

LABELS = {
    "flatness_um": "Flatness",
    "flatness_pv_um": "Flatness, peak to valley",
    "flatness_ls_pv_um": "Flatness, about the least-squares plane",
    "interface_tilt_urad": "Tilt between the interfaces",
    "sensor_uF": "Sensor stack",
    "actuator_uF": "Actuator stacks",
    "stroke_um": "Stroke, three stacks",
    "stroke_one_stack_um": "Stroke, one stack",
    "stroke_two_stacks_um": "Stroke, two stacks",
    "stroke_hysteresis_percent": "Stroke hysteresis",
    "stroke_hysteresis_one_stack_percent": "Stroke hysteresis, one stack",
    "stroke_hysteresis_two_stacks_percent": "Stroke hysteresis, two stacks",
    "k_N_per_um": "Stiffness, closed circuit",
    "k_closed_N_per_um": "Stiffness, closed circuit",
    "k_open_N_per_um": "Stiffness, open circuit",
    "k_ratio": "Stiffness, open over closed",
    "k_closed_windowed_N_per_um": "Stiffness, by time windows",
    "creep_per_decade_percent": "Creep per decade",
    "hysteresis_percent": "Hysteresis",
    "hysteresis_small_signal_percent": "Hysteresis, smallest sine",
    "hysteresis_amplitude_V": "Largest sine at the DAC",
    "sensor_hysteresis_percent": "Hysteresis of the sensor",
    "sensor_highpass_Hz": "High-pass, with resistor",
    "sensor_highpass_without_Hz": "High-pass, without resistor",
    "sensor_capacitance_implied_uF": "Sensor stack, from the corner",
    "sensor_gain_V_per_V": "Sensor gain",
    "x_bending_Hz": "Bending in x",
    "x_bending_damping_percent": "Bending in x, damping",
    "x_bending_harmonic_3_Hz": "Bending in x, 3rd harmonic",
    "x_bending_harmonic_5_Hz": "Bending in x, 5th harmonic",
    "y_bending_Hz": "Bending in y",
    "y_bending_damping_percent": "Bending in y, damping",
    "y_bending_harmonic_3_Hz": "Bending in y, 3rd harmonic",
    "z_torsion_Hz": "Torsion about z",
    "z_torsion_damping_percent": "Torsion about z, damping",
    "axial_resonance_Hz": "Axial resonance",
    "axial_damping_percent": "Axial damping",
    "second_resonance_Hz": "Second resonance",
    "vs_zero_Hz": "Zero of sensor Vs",
    "gain_de_um_per_V": "Gain of encoder de",
    "gain_da_um_per_V": "Gain of interferometer da",
    "gain_Vs_V_per_V": "Gain of sensor Vs",
    "k_resonance_N_per_um": "Stiffness, from the resonance",
    "mass_line_um_per_V": "Mass line",
    "mass_line_kg": "Moved mass",
    "coherent_Vs_Hz": "Vs coherent up to",
    "coherent_de_Hz": "de coherent up to",
    "coherent_da_Hz": "da coherent up to",
    "ga_N_per_V": "Actuator constant",
    "gs_V_per_m": "Sensor constant",
    "dx_um": "Misalignment dx",
    "dy_um": "Misalignment dy",
}


RECORD_LABELS = {
    "z_um": "heights",
    "one_stack": "one stack",
    "two_stacks": "the two other stacks",
    "closed_circuit": "closed circuit",
    "open_circuit": "open circuit",
    "with_resistor": "with the resistor",
    "without_resistor": "without the resistor",
    "x_bending": "x-bending",
    "y_bending": "y-bending",
    "torsion_left": "torsion, hit at the left",
    "torsion_top": "torsion, hit at the top",
    "low_repeat": "second low record",
    "high_repeat": "second high record",
    "without_encoder_low": "low record without encoder",
    "without_encoder_high": "high record without encoder",
}


def label_of(quantity: str) -> str:
    """Words for a quantity; those of another package's come from its name: `insulation_ohm` is "Insulation"."""
    return LABELS.get(quantity) or _from_name(quantity)


def label_and_name(quantity: str) -> str:
    """`Misalignment dy (dy_um)`: the words, and the code name that commands take."""
    return f"{label_of(quantity)} ({quantity})"


def with_labels(text: str) -> str:
    """A sentence with the labels of the quantities and records that it names by their code names; names of files stay,
    and a pure number loses its unit 1. What is stored keeps the code names: a certificate is judged again and its
    sentences are compared."""
    return _PURE.sub("", _NAMES.sub(lambda found: _NAMED[found.group()], text))


_NAMED = RECORD_LABELS | LABELS
_NAMES = re.compile(r"(?<![\w./])(?:" + "|".join(sorted(_NAMED, key=len, reverse=True)) + r")\b(?!\.\w)")
_PURE = re.compile(r"(?<=\d) 1(?= is (?:above|below|inside) the |\)|$)")


def _from_name(quantity: str) -> str:
    words = without_unit(quantity).replace("_", " ").strip() or quantity
    return words[0].upper() + words[1:]
