"""The faults of simulated units, and the findings that must follow from each."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from accept.simulate.apa import Figures, dead_stack, heights
from accept.simulate.converters import NOISE, RANGE_V
from accept.simulate.hammer_records import DoubleHits
from accept.simulate.records import Columns
from specs.plugins import product_named

WITH_ENCODER = ("apa", "strut")
KINDS = (*WITH_ENCODER, "strut-plates")  # products that can be simulated


@dataclass(frozen=True)
class Remedy:
    """A remedy for a bench error. step: to be measured again; stems: beginnings of its record names."""

    words: str
    step: str = "frf"
    stems: tuple[str, ...] = ("frf_",)


@dataclass(frozen=True)
class UnitFault:
    """A fault of a simulated unit. kinds: of unit that can have it; shows: (quantity, verdict) in a judgement by the
    spec of its kind; unexplained: the same until the gap analysis has named the cause of a strut, none if equal;
    figures: the APA with it; model: changes of the model's values, from its values; spoil: the record with it, by file
    stem; cut: file stems of records that end in the middle; double: hits that bounce; remedy: at the bench, None if the
    part itself is bad."""

    words: str
    kinds: tuple[str, ...]
    shows: tuple[tuple[str, str], ...]
    figures: Callable[[Figures], Figures] | None = None
    model: Callable[[Mapping[str, float]], dict[str, float]] | None = None
    spoil: Callable[[str, Columns], Columns] | None = None
    cut: tuple[str, ...] = ()
    double: DoubleHits | None = None
    unexplained: tuple[tuple[str, str], ...] = ()
    remedy: Remedy | None = None

    def shown(self, kind: str) -> tuple[tuple[str, str], ...]:
        """Return the findings that a judgement of a unit of this kind must hold before its gap analysis."""
        return self.unexplained if product_named(kind).family == "strut" and self.unexplained else self.shows


def _warp(figures: Figures) -> Figures:
    return replace(figures, heights_um=heights(np.random.default_rng(14), 14.0))


def _soft_shell(figures: Figures) -> Figures:
    x, y, axial, torsion = figures.modes_Hz
    return replace(figures, modes_Hz=(0.86 * x, y, axial, torsion))


def _turn(c: Columns) -> Columns:
    return {"Vs": -np.asarray(c["Vs"]) + 0.0}


def _exchange(c: Columns) -> Columns:
    return {"de": c["da"], "da": c["de"]}


def _late(c: Columns) -> Columns:
    return {"de": np.concatenate([np.zeros(3), np.asarray(c["de"])[:-3]])}


def _dead(c: Columns) -> Columns:
    return {"de": np.where(np.arange(np.size(c["de"])) % 7 == 0, 2.5e-9, 0.0)}


def _clip(c: Columns) -> Columns:
    """Clip Vs: its amplifier is set ten times too sensitive."""
    return {"Vs": np.clip(10.0 * np.asarray(c["Vs"]), -RANGE_V, RANGE_V)}


def _silent(c: Columns) -> Columns:
    """Return Vs of an input without a plug: noise alone."""
    sensor = np.asarray(c["Vs"])
    own = np.random.default_rng(zlib.crc32(sensor.tobytes()))  # of each record, as noise is
    return {"Vs": NOISE["Vs"] * own.standard_normal(sensor.size)}


_NO_FRF = (("axial_resonance_Hz", "no_result"),)


def _at_rig(words: str, kinds: tuple[str, ...], change: Callable[[Columns], Columns], remedy: str) -> UnitFault:
    """Return a fault of the rig, which changes every record of frequency responses; other records stay."""

    def spoil(stem: str, columns: Columns) -> Columns:
        return columns | change(columns) if stem.startswith("frf_") else columns

    return UnitFault(words, kinds, _NO_FRF, spoil=spoil, remedy=Remedy(remedy))


FAULTS: Mapping[str, UnitFault] = {
    "flatness": UnitFault("interfaces out of plane by 14 um", ("apa",), (("flatness_um", "fail"),), figures=_warp),
    "capacitance": UnitFault(
        "stacks of a third of their capacitance, as APA 3 of the published seven",
        ("apa",),
        (("sensor_uF", "fail"), ("actuator_uF", "fail"), ("sensor_highpass_Hz", "fail")),
        figures=partial(replace, sensor_uF=1.72, actuator_uF=5.18),  # [STB] 2.2: as if they were half the size
    ),
    "dead_stack": UnitFault("one stack does not move", ("apa",), (("stroke_um", "fail"),), figures=dead_stack),
    "soft": UnitFault(
        "shell too soft along its axis",
        ("apa",),
        (("k_closed_N_per_um", "fail"),),
        figures=partial(replace, k_closed_N_per_um=1.45, k_open_N_per_um=1.96),
    ),
    "soft_bending": UnitFault("shell too soft in bending", ("apa",), (("x_bending_Hz", "fail"),), figures=_soft_shell),
    "hysteresis": UnitFault(
        "loops of 24 %", ("apa",), (("hysteresis_percent", "fail"),), figures=partial(replace, loop=0.24)
    ),
    "double_hit": UnitFault(
        "the hammer bounces in the x-bending record",
        ("apa",),
        (("x_bending_Hz", "no_result"),),
        double=DoubleHits(),
        remedy=Remedy("hit once, briefly, and let the hammer spring back", "spurious_modes", ("bending_", "torsion_")),
    ),
    "wrong_payload": UnitFault(
        "8 kg on the bench",
        KINDS,
        (("axial_resonance_Hz", "no_result"),),
        model=lambda _: {"bench.payload_kg": 8.0},
        unexplained=(("axial_resonance_Hz", "fail"),),  # an APA's stiffness by the added mass tells of it
        remedy=Remedy("put the payload that was stated on the bench"),
    ),
    "polarity": _at_rig("sensor stack Vs is reversed", KINDS, _turn, "reverse the connection of sensor stack Vs"),
    "exchanged": _at_rig(
        "encoder de and interferometer da are exchanged",
        ("strut",),
        _exchange,
        "exchange the plugs of encoder de and interferometer da",
    ),
    "offset": _at_rig(
        "encoder de is stored three samples late",
        WITH_ENCODER,
        _late,
        "correct the acquisition settings, by which encoder de is stored with an offset",
    ),
    "dead_encoder": _at_rig(
        "encoder de stands still but for its last digit", WITH_ENCODER, _dead, "check plug and supply of encoder de"
    ),
    "dead_sensor": _at_rig(
        "sensor stack Vs is noise alone",
        ("strut-plates",),  # to the others it would deal out other faults by the seeds of their trainings
        _silent,
        "check the plug of sensor stack Vs",
    ),
    "clipped": _at_rig(
        "sensor stack Vs leaves the converter's range", KINDS, _clip, "set the range of sensor stack Vs higher"
    ),
    "truncated": UnitFault(
        "the high record ends in the middle of the file",
        KINDS,
        _NO_FRF,
        cut=("frf_noise_hf",),
        remedy=Remedy("copy the high record again"),
    ),
}


def remedies(kind: str) -> list[Remedy]:
    """Return the distinct remedies at the bench for a unit of this kind, by their words."""
    found = {f.remedy for f in FAULTS.values() if kind in f.kinds and f.remedy is not None}
    return sorted(found, key=lambda remedy: remedy.words)
