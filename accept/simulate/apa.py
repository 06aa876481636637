"""The measurements on an APA except frequency responses: randomly drawn properties, and records that show them."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from accept.simulate.converters import in_steps
from accept.simulate.hammer_records import FS, DoubleHits, ShellMode, hammer_record
from accept.simulate.records import Columns, DrivenUnit, slow_record
from accept.simulate.unit_request import UnitRequest
from checks.acceptance import POSITIONS_MM, FRAME_Hz, minimum_zone
from checks.arrays import Array
from checks.model import highpass_corner, stroke_of, time_simulation
from checks.signals import Rig
from specs.bench import STACK_V

UM = 1e-6
START_V, TOP_V = STACK_V
STROKE_FS, STROKE_PERIOD_S, STROKE_CYCLES = 1000.0, 10.0, 2  # two cycles: the first rise is wider than a settled loop
GAUGE_STEP, GAUGE_NOISE = 1e-7, 5e-8  # m: last digit of the gauge, its rms noise
MASS_FS, MASS_S = 100.0, 30.0  # rate and length of a mass step record
# When the mass is added and removed: drawn between ([STB] 3.1.7: about 15 and 22 s).
PUT_S, TAKEN_S = (14.0, 16.0), (21.0, 23.0)
GRAVITY = 9.80665
RISE_S = 0.02  # of a mass put down by hand
RING_HZ, RING_S, RING_SHARE = 14.0, 0.08, 0.1  # of its ringing: the unit under the added mass
LF_FS, LF_S, LF_V, LF_HZ = 200.0, 150.0, 0.5, (0.1, 5.0)  # slow sweep for the high-pass of the sensor stack
PROBE_STEP_UM = 0.5  # last digit of the probe readout; heights of [STB] 2.1 are multiples of it
HAMMERED = {"x_bending": "bending_X_top", "y_bending": "bending_Y_top"} | {
    key: key for key in ("torsion_left", "torsion_top")
}
GAIN = 3e-7  # rad/N at rest


@dataclass(frozen=True)
class Figures:
    """The properties of one APA beyond its model. heights_um: at the 8 probe points; loop: relative width of the loops
    over the largest drive; creep: per decade; modes_Hz: x-bending, y-bending, axial, torsion, one end fixed, as
    measured ([STB] 2.4) and, the last two, by the frame's public matrices."""

    heights_um: tuple[float, ...]
    sensor_uF: float
    actuator_uF: float
    stacks_um: tuple[float, float, float]
    k_closed_N_per_um: float
    k_open_N_per_um: float
    modes_Hz: tuple[float, float, float, float]
    damping_ratio: float = 0.008
    creep: float = 0.02
    loop: float = 0.10
    mass_kg: float = 6.4
    resistor_ohm: float = 80600.0

    @property
    def flatness_um(self) -> float:
        x, y = np.array(POSITIONS_MM).T
        return minimum_zone(x, y, np.array(self.heights_um) / 1e3).half_width * 1e3

    @property
    def corner_Hz(self) -> float:
        return highpass_corner(self.resistor_ohm, self.sensor_uF * 1e-6)

    def truth(self) -> dict[str, Any]:
        return asdict(self) | {
            "flatness_um": self.flatness_um,
            "stroke_um": sum(self.stacks_um),
            "sensor_highpass_Hz": self.corner_Hz,
        }


def draw(rng: np.random.Generator) -> Figures:
    """Return an APA like the good ones of [STB] (tables 2.1 to 2.4, 3.3)."""
    stack = rng.normal(121.0, 1.5)
    k, size = rng.normal(1.70, 0.01), rng.normal(1.0, 0.004)
    return Figures(
        heights_um=heights(rng, rng.uniform(1.0, 6.0)),
        sensor_uF=round(rng.normal(4.95, 0.06), 2),
        actuator_uF=round(rng.normal(9.85, 0.08), 2),
        stacks_um=(stack, stack, stack),
        k_closed_N_per_um=k,
        k_open_N_per_um=1.35 * k,
        modes_Hz=(280.0 * size, 412.0 * size, FRAME_Hz[0] * size, FRAME_Hz[1] * size),
    )


def heights(rng: np.random.Generator, flatness_um: float) -> tuple[float, ...]:
    """Return probe heights [um] of two interfaces of this flatness on a tilted part; the first is zero."""
    x, y = np.array(POSITIONS_MM).T
    rough = rng.uniform(-1.0, 1.0, x.size)
    rough *= flatness_um / minimum_zone(x, y, rough).half_width
    z = rough + rng.uniform(-1.0, 1.0) * x + rng.uniform(-0.8, 0.8) * y
    return tuple(float(h) for h in in_steps(z - z[0], PROBE_STEP_UM))


def records(bench: DrivenUnit, figures: Figures, double: DoubleHits | None) -> dict[str, Columns]:
    """Return file stem -> columns of every record of an APA but those of frequency responses."""
    request = bench.request
    one, *others = figures.stacks_um
    out = {
        "stroke_one_stack": _stroke(request, figures, one, "stroke_one_stack"),
        "stroke_two_stacks": _stroke(request, figures, sum(others), "stroke_two_stacks"),
        "add_mass_closed_circuit": _mass(request, figures, figures.k_closed_N_per_um, "add_mass_closed_circuit"),
        "add_mass_open_circuit": _mass(request, figures, figures.k_open_N_per_um, "add_mass_open_circuit"),
        "hysteresis": slow_record(bench, "hysteresis", figures.loop),
        "sweep_lf_with_R": _highpass(bench, figures.corner_Hz, "sweep_lf_with_R"),
        "sweep_lf": _highpass(bench, 0.0, "sweep_lf"),
    }
    return out | {HAMMERED[key]: _hammer(request, key, figures, double) for key in HAMMERED}


def _stroke(request: UnitRequest, figures: Figures, stroke_um: float, name: str) -> Columns:
    """Return two slow rises from -20 V to 150 V and back, and the gauge's displacement."""
    t = np.arange(round(STROKE_FS * STROKE_PERIOD_S * STROKE_CYCLES)) / STROKE_FS
    span = TOP_V - START_V
    V = START_V + 0.5 * span * (1.0 - np.cos(2 * np.pi * t / STROKE_PERIOD_S))
    d = stroke_of(stroke_um * UM, span, figures.loop)(V)
    d += GAUGE_NOISE * request.rng(f"noise of {name}").standard_normal(t.size)
    return {"t": t, "V": V, "d": in_steps(d, GAUGE_STEP)}


def _mass(request: UnitRequest, figures: Figures, k_N_per_um: float, name: str) -> Columns:
    """Return the encoder's record while the mass is added and removed by hand."""
    rng = request.rng(f"mass of {name}")
    t = rng.uniform(0.0, 3.0) + np.arange(round(MASS_FS * MASS_S)) / MASS_FS
    moments = (t[0] + rng.uniform(*PUT_S), t[0] + rng.uniform(*TAKEN_S))
    deflection = -figures.mass_kg * GRAVITY / (k_N_per_um * 1e6)
    de = mass_steps(t, moments, deflection, figures.creep)
    return {"t": t, "de": request.converters.read("de", de, rng)}


def mass_steps(t: Array, moments: tuple[float, float], deflection: float, per_decade: float) -> Array:
    """Return the deflection (N,) at t (N,) [s] under a mass added and removed at these moments. `deflection` is reached
    0.1 s after each step and creeps by per_decade per decade of time; steps rise within 20 ms and ring a little."""
    out = np.zeros(t.size)
    for moment, sign in zip(moments, (1.0, -1.0), strict=True):
        after = np.maximum(t - moment, 0.0)
        creep = 1.0 + per_decade * np.log10(np.maximum(after, 1e-3) / 0.1)
        ring = RING_SHARE * np.sin(2 * np.pi * RING_HZ * after) * np.exp(-after / RING_S)
        out += sign * deflection * np.minimum(after / RISE_S, 1.0) * (creep + ring)
    return out


def _highpass(bench: DrivenUnit, corner_Hz: float, name: str) -> Columns:
    """Return a slow sweep and the sensor stack's answer, with a resistor across it (corner_Hz) or none (0)."""
    request = bench.request
    rig = Rig(fs=LF_FS, mean_V=0.0, ramp_s=0.0)
    Va = request.converters.dac(rig.sweep(*LF_HZ, LF_S, LF_V).proper)
    model = bench.model.with_values({"sensor.highpass_Hz": corner_Hz})
    Vs = time_simulation(model, Va.size, LF_FS, channels=("Vs",))(Va)["Vs"]
    read = request.converters.read("Vs", Vs, request.rng(f"noise of {name}"))
    return {"t": np.arange(Va.size) / LF_FS, "Va": Va, "Vs": read}


def _hammer(request: UnitRequest, key: str, figures: Figures, double: DoubleHits | None) -> Columns:
    bounced = double if key == "x_bending" else None
    force, angle = hammer_record(shell_modes(key, figures), request.rng(f"hammer, {key}"), bounced)
    step = 1.0 / FS
    return {"Track1": force, "Track2": angle, "Track1_X_Resolution": step, "Track2_X_Resolution": step}


def shell_modes(key: str, figures: Figures) -> list[ShellMode]:
    """Return the modes in an impact ([STB] 2.4.3 to 2.4.5): both bendings with their overtones; from left and top also
    the axial mode, since no hit is exactly across the axis; from the left torsion too."""
    x, y, axial, torsion = figures.modes_Hz
    shown = {
        "x_bending": [(x, 1.0), (3.0 * x, 0.02), (5.0 * x, 0.006)],
        "y_bending": [(y, 1.0), (2.96 * y, 0.02)],
        "torsion_left": [(0.953 * x, 0.6), (1.007 * y, 0.5), (axial, 0.05), (torsion, 0.3)],
        "torsion_top": [(0.953 * x, 0.6), (1.007 * y, 0.5), (axial, 0.05)],
    }[key]
    return [ShellMode(f, figures.damping_ratio, GAIN * share) for f, share in shown]


def dead_stack(figures: Figures) -> Figures:
    """Let one of the two stacks that are measured together not move."""
    one, two, _ = figures.stacks_um
    return replace(figures, stacks_um=(one, two, 0.0))


def sections(figures: Figures) -> dict[str, dict[str, Any]]:
    """Return sections of unit.toml, frequency responses apart."""
    return {
        "flatness": {"points": "flatness.csv"},
        "capacitance": {"sensor_uF": figures.sensor_uF, "actuator_uF": figures.actuator_uF},
        "stroke": {"one_stack": "stroke_one_stack.mat", "two_stacks": "stroke_two_stacks.mat"},
        "stiffness": {
            "closed_circuit": "add_mass_closed_circuit.mat",
            "open_circuit": "add_mass_open_circuit.mat",
            "mass_kg": figures.mass_kg,
        },
        "hysteresis": {"record": "hysteresis.mat"},
        "sensor_highpass": {
            "with_resistor": "sweep_lf_with_R.mat",
            "without_resistor": "sweep_lf.mat",
            "resistor_ohm": figures.resistor_ohm,
        },
        "spurious_modes": {key: f"{stem}.mat" for key, stem in HAMMERED.items()},
    }


def flatness_columns(figures: Figures) -> dict[str, Array]:
    """Return columns of flatness.csv: positions [mm] and heights [um] of the probe points."""
    x, y = np.array(POSITIONS_MM, dtype=float).T
    return {"x_mm": x, "y_mm": y, "z_um": np.array(figures.heights_um)}
