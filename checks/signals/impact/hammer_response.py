"""The response to a hammer over the good hits of all records of a test, with its modes and pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from checks.errors import RecordError
from checks.picture import Mark, Panel
from checks.record import Record
from checks.signals.impact.hammer import HammerTests, analyse_records
from checks.signals.impact.impact_response import fates, impact_frf, impact_modes
from checks.signals.impact.impacts import Impact, ImpactRules, impacts_panel, is_upright
from checks.signals.impact.modal_fit import Mode
from checks.signals.record_response import RecordResponse
from checks.signals.spectral.bode import bode

ANALYSER = 2.56  # sampling rate over the highest frequency that the filter of an analyser leaves
SAME_RATE = 1e-6  # relative
LEAST_SAMPLES = 2  # of the time in which a second hit is looked for


@dataclass(frozen=True, eq=False)
class HammerTestResponse(RecordResponse):
    """Response of a hammer test. tests: impacts, forces and windowed spectra of the hits; modes: by channel."""

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
            drawn[name] = replace(drawn[name], items=(*drawn[name].items, *marks))
        unit = self.units.get(self.frf.input) or "N"
        for record, force, impacts in zip(self.records, self.tests.forces, self.tests.impacts, strict=True):
            drawn[f"impacts of {record.name}"] = impacts_panel(record.name, record.t, force, impacts, unit)
        return drawn


def hammer_response(
    records: Sequence[Record], input: str, estimator: str, f_lo: float, f_hi: float | None, rules: ImpactRules | None
) -> HammerTestResponse:
    """Return the response over the good hits of all records. input: the force; estimator: "h1", "h2", "hv"; f_lo, f_hi:
    band kept [Hz], to 1/2.56 of the sampling frequency without f_hi, where an analyser's filter cuts.

    Raises RecordError if records differ in rate or channels, or fewer than two hits are good."""
    first, names = records[0], " + ".join(r.name for r in records)
    channels = [name for name in first.channels if name != input]
    for record in records:
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
    frf = frf.cut(band[0], band[1], (*hit_notes, *frf.notes))
    units = {name: first.units.get(name, "") for name in (input, *channels)}
    return HammerTestResponse(tuple(records), frf, units, {}, tests, impact_modes(tests, channels, *band))
