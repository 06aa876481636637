"""The misalignment of a strut from its responses: `accept misalign` and `accept.estimate_misalignment`."""

from typing import cast

from accept.analysis.given_responses import Given, responses_given
from accept.base.console import say
from accept.base.documents.analyses import MisalignmentDocument, Offset
from accept.gap import Responses, responses
from accept.models.lookup_cache import table_for
from accept.models.model_file import AS_BUILT, as_weighed, open_model_file
from accept.units import UNIT_FILE, UnitError, UnitFolder
from checks.cause import NoResult, Reason
from checks.errors import RecordError
from checks.fitting import F_HI, F_LO
from checks.misalignment import CHANNEL_SETS, MisalignmentEstimate, estimate_misalignment
from checks.verdict import Verdict
from specs.plugins import product_named


def estimate_unit(folder: UnitFolder | Given, model: str | None = None) -> MisalignmentEstimate:
    """Estimate the misalignment of a strut in this process alone: each process that a caller's script started would run
    that script again. Raises NoResult if the data cannot tell, UnitError, RecordError, ModelError."""
    found = estimate_or_reason(folder, model, workers=1)
    reason = found if isinstance(found, Reason) else found.reason
    if reason is not None:
        raise NoResult(reason)
    return cast(MisalignmentEstimate, found)


def estimate_or_reason(
    folder: UnitFolder | Given, model: str | None = None, workers: int | None = None
) -> MisalignmentEstimate | Reason:
    """Estimate the misalignment of a strut, or return why it is undetermined. workers: processes that build a missing
    table; None: one for each core. Raises UnitError, RecordError, ModelError."""
    given, measured = (
        open_model_file(model or AS_BUILT),
        _responses_of(folder),
    )  # records are refused before a table is built
    for words in measured.remarks:
        say(words)
    table = table_for(given.model, say, workers=workers)
    try:
        weighed = as_weighed(given, measured.serial, measured.payload_kg).model
        return estimate_misalignment(weighed, measured.first, table, measured.second)
    except NoResult as e:
        return e.reason


def _responses_of(unit: UnitFolder | Given) -> Responses:
    """Return the responses, with the sensor stack's if recorded: they help the fit."""
    most, least = CHANNEL_SETS
    if isinstance(unit, Given):
        found = responses_given(unit, 0.0, F_LO, F_HI, most)
        if missing := [c for c in least if c not in found.first.channels]:
            raise RecordError(f"{found.serial}: lacks {' and '.join(missing)}; a misalignment shows in de over da")
        return found
    if why := product_named(unit.kind).absent.get("misalignment"):
        raise UnitError(unit.path / UNIT_FILE, [f"kind = '{unit.kind}': {why}, so de over da shows no misalignment"])
    try:
        return responses(unit, channels=most)
    except RecordError:
        return responses(unit, channels=least)


def as_document(serial: str, found: MisalignmentEstimate | Reason) -> MisalignmentDocument:
    """Return the document for scripts ([DESIGN] 4); without an answer it holds no number."""
    reason = found if isinstance(found, Reason) else found.why

    def of(axis: str) -> Offset:
        along = None if isinstance(found, Reason) else found.answer(axis)
        return Offset() if along is None else Offset(along.value, along.U)

    verdict = Verdict.PASS if reason is None else Verdict.NO_RESULT
    words = None if reason is None else str(reason)
    return MisalignmentDocument(serial, of("dx"), of("dy"), verdict.value, words)
