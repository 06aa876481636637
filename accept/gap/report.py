"""The report of a gap in blocks: what was found, where model and data differ, and why this cause. Terminal, gap.pdf,
gap.html, certificate and screen show them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from accept.gap.document import to_json
from accept.gap.empirical import AddedElement
from accept.gap.report_tables import elements, fitted_values, gap_with_errors, identified, reasons, steps
from accept.gap.sentences import findings, gap_by_channel
from accept.gap.text import data_words, gap_number, headline_of_document, subject, value_words, words_of
from accept.pictures.blocks import Block, Heading, Picture, Role, Sentence, Table
from checks.gap import GapVerdict, Result, Tested

RIVALS = 3  # explanations that a short report lists if none was named
AGREES = "Noise, the stated tolerance and the calibrated values explain every channel."
BEFORE = "Before: the fitted model without {}; after: with them. Both on records that were not fitted."
BANDS = (
    "Bands hold 95 % at each frequency: of the measurement by its noise; of the model after by its stated tolerance "
    "and the covariance of its fitted values, the scatter of the APA's modes among them; of units as the model's file "
    "describes them, drawn from its priors and scatter."
)


def title(serial: str, result: Result) -> str:
    """Return the unit, and what was found."""
    return f"{serial}: {headline_of_document(to_json(serial, result))}"


def report(result: Result, added: Sequence[AddedElement] = ()) -> list[Block]:
    """Return the whole report. added: elements that were added to the improved model without a name."""
    document = to_json("", result)
    agrees = [Sentence(AGREES, Role.FOUND)] if result.verdict == GapVerdict.NO_MISSING else []
    before = [Sentence(BEFORE.format(subject(document)), Role.LEGEND)] if result.found else []
    modes = ", ".join(f"{m.f_Hz:.0f} Hz {gap_number(m.G)}" for m in result.gap_after.modes)
    by_step, known = steps(document), identified(result)
    blocks = [
        *agrees,
        *findings(document, data_words(result.fit)),
        Heading("Where model and data disagree"),
        *before,
        Picture(("map",)),
        gap_with_errors(result, document),
        by_step,
        Sentence(f"G after, within 5 Hz about each mode: {modes}.", Role.DETAIL),
        *_remarks(result),
        reasons(result),
        known,
        *_limits(result),
        elements(added),
        fitted_values(result, len(by_step.rows) + len(known.rows)),
        Heading("Bode plots, on records that were not fitted", new_page=True),
        Sentence(BANDS, Role.LEGEND),
        *(Picture((f"{c} magnitude", f"{c} phase", f"{c} deviation")) for c in result.before.data.channels),
    ]
    return _with_rows(blocks)


def short_report(result: Result) -> tuple[list[Block], list[Block]]:
    """Return what fits a screen, the most important first, and what is never cut: the best candidates if an effect is
    missing and none was named, and the gap."""
    document = to_json("", result)
    found = findings(document, data_words(result.fit))
    missing = not result.found and result.verdict != GapVerdict.NO_MISSING
    tried = reasons(result)
    rivals = [replace(tried, rows=tried.rows[:RIVALS])] if missing else []
    return (
        _with_rows([*found, steps(document), *_remarks(result), *_limits(result)]),
        _with_rows([*rivals, gap_by_channel(document)]),
    )


def _with_rows(blocks: Sequence[Block]) -> list[Block]:
    return [b for b in blocks if not isinstance(b, Table) or b.rows]


def _remarks(result: Result) -> Iterator[Sentence]:
    """Yield the outcome of experiments, the band that is explained worst, and notes."""
    yield from (Sentence(f"Experiment, {t.words}: {_outcome(t)}.") for t in result.experiments)
    if result.where and result.verdict != GapVerdict.EXPLAINED:
        w = result.where[0]
        band = f"{w.channel}, {w.f_lo_Hz:.1f} to {w.f_hi_Hz:.1f} Hz, {w.excess_dB:.0f} dB above chance"
        yield Sentence(f"Worst: {band}.")
    for note in result.notes:
        end = "" if note.endswith((".", "?")) else "."
        yield Sentence(f"{note[0].upper()}{note[1:]}{end}")


def _outcome(t: Tested) -> str:
    if t.against and not t.channels:
        return t.against
    G = ", ".join(f"{c} {gap_number(g.G)}" for c, g in t.channels.items())
    level = f"; {', '.join(t.level)} depends on the drive level" if t.level else ""
    return f"{'holds' if t.holds else f'does not hold: {t.against}'} (G {G}){level}"


def _limits(result: Result) -> list[Block]:
    """Return the smallest effects that would have been detected."""
    if not result.detection_limits:
        return []
    parts = (
        f"{words_of(effect)} ({', '.join(value_words(effect, k, v) for k, v in values.items())})"
        for effect, values in result.detection_limits.items()
    )
    return [Heading("Would have been seen with 90 % power, from"), Sentence("; ".join(parts))]
