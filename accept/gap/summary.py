"""The result of the gap workflow on a terminal: at most 24 lines of 80 columns, the gap itself never cut."""

import textwrap
from collections.abc import Iterator

from accept.gap.reasons import candidates
from accept.gap.text import (
    TWO,
    chance,
    data_words,
    experiment_line,
    gap_number,
    headline_of_result,
    parameter_line,
    poles_of,
    step_line,
    value_words,
    words_of,
)
from checks.gap import GapVerdict, Result

LINES, COLUMNS = 24, 80  # of a terminal
MISALIGNMENT = "misalignment"  # `accept misalign` estimates it too, from fewer data: the report says which these are
RIVALS = 3  # explanations that are shown if none was named; gap.json and gap.pdf list more
_TIED = "\u00a0"  # where no line is broken


def summary(serial: str, r: Result) -> list[str]:
    """Return at most 24 lines of 80 columns for a terminal; the gap itself is never cut."""
    lines = _wrap(f"{serial}: {headline_of_result(r)} (model {r.model}, damping {r.damping})", "")
    before = "before (fitted without the named effects)" if r.named else "before"  # the steps have other values
    gaps = [f"  gap on unseen records, {before} -> after:"]
    for c, gap in r.gap_before.channels.items():
        gaps.append(f"    {c}: G {gap_number(gap.G)} -> {gap_number(r.gap_after.channels[c].G)}")
    rivals = _rivals(r)
    more = [line for words, indent in result_lines(r) for line in _wrap(words, indent)]
    room = LINES - len(lines) - len(gaps) - len(rivals)
    cut = [] if len(more) <= room else ["  ... for the rest see gap.json and gap.pdf"]
    return [*lines, *more[: room - len(cut)], *cut, *rivals, *gaps]


def _rivals(r: Result) -> list[str]:
    """Return the best candidates, each with its gain and why it was not named, if an effect is missing and none was
    named."""
    if r.named or r.elements or r.verdict == GapVerdict.NO_MISSING:
        return []
    best = [f"{words}: {gain}, {why}" for words, gain, _, why in list(candidates(r))[:RIVALS]]
    lines = [line for words in best for line in _wrap(words, "    ", most=2)]
    return ["  tried, with the gain in ln L on unseen records:", *lines] if lines else []


def result_lines(r: Result) -> Iterator[tuple[str, str]]:
    """Yield the statements besides the gap, the most important first, each with its indent."""
    for n in r.named:
        yield n.sentence, "  "
        yield f"{parameter_line(n)}  p{_TIED}{chance(n.p).replace(' ', _TIED)}", "    "
        if n.effect == MISALIGNMENT:
            yield f"fitted to {data_words(r.fit)}", "    "
    for e in r.elements:
        yield e.sentence, "  "
        yield f"next experiment: {e.experiment}", "    "
    for a in r.ambiguous:
        yield f"cannot be distinguished: {', '.join(map(words_of, a.effects))}; next experiment: {a.experiment}", "  "
    if len(r.steps) > TWO:
        for step in r.steps:
            yield step_line(step.effect, step.channels), "  "
    for u in r.unnamed:
        level = ", depends on the level" if u.level_dependent else ""
        yield f"unidentified effect: {u.channel}, poles {poles_of(u.poles_Hz, u.ci95, u.at_edge)}{level}", "  "
    for t in r.experiments:
        yield experiment_line(t), "  "
    if r.where and r.verdict != GapVerdict.EXPLAINED:
        w = r.where[0]
        yield f"worst: {w.channel}, {w.f_lo_Hz:.1f} to {w.f_hi_Hz:.1f} Hz, {w.excess_dB:.0f} dB above chance", "  "
    for note in r.notes:
        yield f"note: {note}", "  "
    if r.detection_limits:
        yield "smallest effects that would have been detected (90 % power):", "  "
        limits = (
            f"{words_of(effect)} {value_words(effect, *list(values.items())[-1])}"
            for effect, values in r.detection_limits.items()
        )
        yield ", ".join(limits), "    "


def _wrap(words: str, indent: str, most: int | None = None) -> list[str]:
    lines = textwrap.wrap(
        words,
        COLUMNS,
        initial_indent=indent,
        subsequent_indent=indent + "  ",
        break_on_hyphens=False,
        max_lines=most,
        placeholder=" ...",
    )
    return [line.replace(_TIED, " ") for line in lines]
