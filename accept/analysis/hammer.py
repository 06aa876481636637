"""Responses and modes of hammer tests: `accept frf --hammer` and `accept.hammer_response`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from accept.analysis.record_responses import MeasuredResponse, mode_json, vet_sizes
from checks.errors import RecordError
from checks.record import Record
from checks.signals import HammerTestResponse, ImpactRules, hammer_response

ESTIMATORS = ("h1", "h2", "hv")


@dataclass(frozen=True, eq=False)
class ImpactResponse(HammerTestResponse, MeasuredResponse):
    """Response of a hammer test: with the impacts of each record, good or set aside, and the modes of each channel.

    tests: impacts, forces and windowed spectra of the hits; modes: by channel, each with U_Hz and U_damping (k = 2)."""

    def __repr__(self) -> str:
        listed = {c: ", ".join(f"{m.f_Hz:.2f}" for m in modes) for c, modes in self.modes.items()}
        seen = "; ".join(f"{c} {words or 'none'}" for c, words in listed.items())
        of = f"{', '.join(self.frf.channels)} over {self.frf.input}"
        return f"ImpactResponse({of}; {self.tests.tally}; modes [Hz]: {seen})"


def hammer_responses(
    records: Sequence[Record],
    input: str,
    estimator: str = "h1",
    f_lo: float = 0.0,
    f_hi: float | None = None,
    rules: ImpactRules | None = None,
) -> ImpactResponse:
    """Return the response over the good hits of all records (`checks.signals.hammer_response`). Raises RecordError."""
    if estimator not in ESTIMATORS:
        raise RecordError(f"estimator = '{estimator}': expected one of {', '.join(ESTIMATORS)} for a hammer test")
    for record in records:
        vet_sizes(record)
    return ImpactResponse(**vars(hammer_response(records, input, estimator, f_lo, f_hi, rules)))


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
        "modes": [mode_json(c, mode) for c, modes in response.modes.items() for mode in modes],
    }
