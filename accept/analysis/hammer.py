"""Responses and modes of hammer tests: `accept frf --hammer` and `accept.hammer_response`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from accept.analysis.record_responses import U_CLOCK, MeasuredResponse, cut, vet_sizes
from checks.errors import RecordError
from checks.picture import Mark, Panel
from checks.record import Record
from checks.signals.impact.hammer import HammerTests, analyse_records
from checks.signals.impact.impact_panels import impacts_panel
from checks.signals.impact.impact_response import fates, impact_frf, impact_modes
from checks.signals.impact.impacts import Impact, ImpactRules, is_upright, tally
from checks.signals.impact.modal_fit import Mode
from checks.signals.spectral.bode import bode

ESTIMATORS = ("h1", "h2", "hv")
ANALYSER = 2.56  # sampling rate over the highest frequency that the filter of an analyser leaves
SAME_RATE = 1e-6  # relative
LEAST_SAMPLES = 2  # of the time in which a second hit is looked for


@dataclass(frozen=True, eq=False)
class ImpactResponse(MeasuredResponse):
    """Response of a hammer test: with the impacts of each record, good or set aside, and the modes of each channel.

    tests: impacts, forces and windowed spectra of the hits; modes: by channel, each with U_Hz and U_damping (k = 2)."""

    tests: HammerTests
    modes: dict[str, tuple[Mode, ...]]

    @property
    def impacts(self) -> dict[str, tuple[Impact, ...]]:
        """Return the impacts of each record, good or with the fault for which it was set aside."""
        return {r.name: found for r, found in zip(self.records, self.tests.impacts, strict=True)}

    @property
    def added_decay(self) -> float:
        """Return the decay rate [1/s] that the exponential window added to the response, and not to the modes."""
        return self.tests.frfs[0].added_decay

    @property
    def panels(self) -> dict[str, Panel]:
        """Return magnitude with the modes marked, phase, coherence, and the impacts of each record."""
        drawn = bode(self.frf, self.ratios)
        for channel, modes in self.modes.items():
            name = f"{channel} magnitude"
            marks = tuple(Mark(m.f_Hz, label=f"{m.f_Hz:.4g} Hz", role="model") for m in modes)
            panel = drawn[name]
            drawn[name] = Panel(**{**panel.__dict__, "items": (*panel.items, *marks)})
        unit = self.units.get(self.frf.input) or "N"
        for record, force, impacts in zip(self.records, self.tests.forces, self.tests.impacts, strict=True):
            drawn[f"impacts of {record.name}"] = impacts_panel(record.name, record.t, force, impacts, unit)
        return drawn

    def __repr__(self) -> str:
        listed = {c: ", ".join(f"{m.f_Hz:.2f}" for m in modes) for c, modes in self.modes.items()}
        seen = "; ".join(f"{c} {words or 'none'}" for c, words in listed.items())
        of = f"{', '.join(self.frf.channels)} over {self.frf.input}"
        return f"ImpactResponse({of}; {tally(self.tests.all_impacts)}; modes [Hz]: {seen})"


def hammer_responses(
    records: Sequence[Record],
    input: str,
    estimator: str = "h1",
    f_lo: float = 0.0,
    f_hi: float | None = None,
    rules: ImpactRules | None = None,
) -> ImpactResponse:
    """Return the response over the good hits of all records. input: the force; f_lo, f_hi: band kept [Hz]; by default
    up to 1/2.56 of the sampling frequency, the cut-off of an analyser's filter.

    Raises RecordError if records differ in rate or channels, or fewer than two hits are good."""
    if estimator not in ESTIMATORS:
        raise RecordError(f"estimator = '{estimator}': expected one of {', '.join(ESTIMATORS)} for a hammer test")
    first, names = records[0], " + ".join(r.name for r in records)
    channels = [name for name in first.channels if name != input]
    for record in records:
        vet_sizes(record)
        if missing := {input, *channels} ^ set(record.channels):
            raise RecordError(f"{record.name}: '{min(missing)}' is not in every record of the test; name alike records")
        if abs(record.fs / first.fs - 1.0) > SAME_RATE:
            raise RecordError(f"{record.name}: sampled at {record.fs:.6g} Hz, {first.name} at {first.fs:.6g} Hz")
        for name in (input, *channels):
            theirs, ours = (r.units.get(name, "") or "no unit" for r in (record, first))
            if theirs != ours:
                raise RecordError(
                    f"{record.name}: {name} states {theirs}, in {first.name} {ours}; hits are averaged in one unit: "
                    f"write the same unit into both headers, such as '{name} (m)'"
                )
    rules = rules or ImpactRules()
    if first.fs * rules.double_hit_s < LEAST_SAMPLES:
        raise RecordError(
            f"{first.name}: sampled at {first.fs:.4g} Hz, too slow for hits: {1e3 * rules.double_hit_s:g} ms, in which "
            f"a double hit is looked for, hold fewer than {LEAST_SAMPLES} samples; is the time in ms?"
        )
    band = f_lo, first.fs / ANALYSER if f_hi is None else min(f_hi, first.fs / 2)
    tracks = [(record[input], [record[c] for c in channels]) for record in records]
    try:
        tests = analyse_records(tracks, first.fs, rules, band)
        hit_notes = [f"{r.name}: {fates(found, r.t)}" for r, found in zip(records, tests.impacts, strict=True)]
        if not tests.frfs:
            raise RecordError(
                "; ".join(hit_notes) + ": two good hits are needed, because U comes from what they differ by"
            )
        frf = impact_frf(tests, channels, input, estimator)
    except RecordError:
        raise
    except ValueError as e:
        raise RecordError(f"{names}: {e}") from e
    pulled = [r.name for r in records if not is_upright(r[input])]
    if pulled:
        hit_notes.append(
            f"{', '.join(pulled)}: the hits are negative in {input}; its sign is turned, so that the phase is relative "
            "to a push"
        )
    frf = cut(frf, band[0], band[1], (*hit_notes, *frf.notes))
    units = {name: first.units.get(name, "") for name in (input, *channels)}
    return ImpactResponse(tuple(records), frf, units, {}, tests, impact_modes(tests, channels, *band))


def U_of(mode: Mode) -> tuple[float, float]:
    """Return U (k = 2) of a mode's frequency [Hz] and damping ratio: scatter between hits, model, and clock (frequency
    only)."""
    scatter = 2.0 * math.hypot(mode.u_f_Hz, mode.u_f_model_Hz)
    return math.hypot(scatter, U_CLOCK * mode.f_Hz), 2.0 * math.hypot(mode.u_damping, mode.u_damping_model)


def hammer_json(response: ImpactResponse) -> dict[str, Any]:
    """Return the additional keys in the JSON of a response to a hammer.

    {"impacts": [{"file", "time_s", "force_N", "good", "fault", "detail"}], "added_decay_per_s", "modes": [{"channel",
    "f_Hz", "U_Hz", "damping_ratio", "U_damping"}]}."""
    return {
        "added_decay_per_s": response.added_decay,
        "impacts": [
            {
                "file": record.name,
                "time_s": float(record.t[i.peak]),
                "force_N": i.force_N,
                "good": i.good,
                "fault": i.fault,
                "detail": i.detail,
            }
            for record, found in zip(response.records, response.tests.impacts, strict=True)
            for i in found
        ],
        "modes": [
            {
                "channel": c,
                "f_Hz": m.f_Hz,
                "U_Hz": U_of(m)[0],
                "damping_ratio": m.damping_ratio,
                "U_damping": U_of(m)[1],
            }
            for c, modes in response.modes.items()
            for m in modes
        ],
    }
