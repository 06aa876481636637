"""The report of a gap in blocks: what was found, where model and data differ, and why this cause."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

from accept.gap.document import candidates, moved_parameters, shift_words, to_json
from accept.gap.improved_model import AddedElement, elements_of
from accept.gap.sketch import place_panel
from accept.gap.text import (
    G_NOTE,
    data_words,
    findings,
    gap_by_channel,
    gap_number,
    headline_of_document,
    number,
    subject,
    symbol,
    unit,
    value_words,
    words_of,
)
from accept.models.model_file import value_label
from accept.pictures.blocks import Block, Heading, Picture, Role, Sentence, Table
from accept.pictures.interactive import page
from checks.fitting import Identifiability, LikelihoodProfile
from checks.gap import GapVerdict, Result, Tested, bode_panels, channel_errors
from checks.picture import Panel
from checks.rounding import rounded, with_U
from specs.units import with_unit

MAP, PLACE = "map", "place"  # pictures: where over frequency, and where in the strut
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
        Picture((MAP, PLACE)),
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


def pictures(result: Result, added: Sequence[AddedElement] = ()) -> dict[str, Panel]:
    """Return the pictures of a report by name; without a place if nothing that was found has one."""
    has_joints = any(name.startswith("joint.") for name in result.before.response.model.values)
    place = place_panel(to_json("", result), of_strut=has_joints)
    return {**bode_panels(result, elements_of(added)), **({} if place is None else {PLACE: place})}


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
    if not result.detection_limits:
        return []
    parts = (
        f"{words_of(effect)} ({', '.join(value_words(effect, k, v) for k, v in values.items())})"
        for effect, values in result.detection_limits.items()
    )
    return [Heading("Would have been seen with 90 % power, from"), Sentence("; ".join(parts))]


LEVEL_NOTE = "Level and phase: rms of what is left over"
TWO = 2  # steps: the model alone and one effect, which the gap before and after says already
PARAMETERS, LEAST_PARAMETERS = 16, 6  # of the fitted values, those that moved furthest: what the page has room for


def gap_with_errors(result: Result, document: Mapping[str, Any]) -> Table:
    """Return the gap by channel with the errors of level and phase; once if nothing was found, for after is before."""
    table, off = gap_by_channel(document), channel_errors(result)
    rows = []
    for c, before, after in table.rows:
        dB, deg, dB_after, deg_after = off[c]
        errors = (f"{dB:.3g} dB", f"{dB_after:.3g} dB", f"{deg:.3g} deg", f"{deg_after:.3g} deg")
        rows.append((c, before, after, *errors) if result.found else (c, before, errors[0], errors[2]))
    if not result.found:
        return Table(table.title, f"{G_NOTE} {LEVEL_NOTE}.", ("Channel", "G", "level", "phase"), tuple(rows))
    added = subject(document)
    # the values behind the map and the curves before may not be those behind G before
    other = "" if result.before.names else f". Their before, as on the map: {added} removed, all other values unchanged"
    note = f"{G_NOTE} G before: the lowest that the model reaches without {added}, fitted again. {LEVEL_NOTE}{other}."
    return Table(table.title, note, (*table.head, "level before", "after", "phase before", "after"), tuple(rows))


def steps(document: Mapping[str, Any]) -> Table:
    """Return G by channel after each named effect, if there are several; the last row is the remaining gap."""
    taken = document["steps"] if len(document["steps"]) > TWO else ()
    channels = list(document["gap_before"]["channels"])
    rows = tuple(
        (
            "nothing named" if s["effect"] is None else f"then {words_of(s['effect'])}",
            *(gap_number(s["channels"][c]) for c in channels),
        )
        for s in taken
    )
    note = "G at the values of the whole explanation, the effects in order of what each explains. Last: what is left."
    return Table("The gap, step by step", note, ("With", *(f"G {c}" for c in channels)), rows)


def reasons(result: Result) -> Table:
    """Return what was tried, and why it was named or not."""
    note = "On records that were not fitted. p of the rest: the chance that noise and tolerance leave as much over."
    head = ("Explanation tried", "gain in ln L", "p of the rest", "decision")
    return Table("Why this cause, and why not another", note, head, tuple(candidates(result)))


def identified(result: Result) -> Table:
    """Return how well the data determine each named value beside all others that were fitted."""
    note = (
        "By curvature: Fisher information at the optimum, priors included. By profile: where ln L has fallen by 1.92 "
        "with all other values fitted again. Wider: than if all others were known. Most alike: the most correlated."
    )
    head = ("Named value", "95 % by curvature", "95 % by profile", "wider by", "most alike")
    rows = []
    for name, it in Identifiability.of_effects(result.fit, [n.effect for n in result.named]).items():
        effect, _, parameter = name.partition(".")
        label = f"{words_of(effect)}: {symbol(effect, parameter)} [{unit(effect, parameter) or '1'}]"
        ends = (result.fit.interval(name), LikelihoodProfile.of(result.fit, name).ci95)
        shown = (" to ".join(rounded(x, it.sd) if isfinite(x) else "open" for x in pair) for pair in ends)
        rival = value_label(result.after.response.model, it.rival)
        rows.append((label, *shown, f"{it.inflation:.3g}", f"{rival} ({it.correlation:+.3f})"))
    return Table("How well each named value is determined", note, head, tuple(rows))


def elements(added: Sequence[AddedElement]) -> Table:
    """Return the elements that were added to the improved model without a name."""
    rows = []
    for one in added:
        gain, poles, zeros = "", f"nothing added: {one.reason}", ""
        if one.fitted is not None:
            element = one.fitted.element
            gain, poles, zeros = number(element.gain), _pairs(element.poles), _pairs(element.zeros)
        rows.append((one.channel, gap_number(one.before), gap_number(one.after), gain, poles, zeros))
    note = (
        "A factor of the channel with these poles and zeros (frequency, damping ratio). It makes the improved model "
        "usable; it has no physical name and is no cause. G on records that were not fitted."
    )
    head = ("Channel", "G without", "G with", "gain", "poles", "zeros")
    return Table("Unidentified elements in the improved model", note, head, tuple(rows))


def fitted_values(result: Result, beside: int) -> Table:
    """Return the fitted values that moved furthest. beside: rows that other tables need on the same page."""
    moved, most = moved_parameters(result), max(LEAST_PARAMETERS, PARAMETERS - beside)
    rows = tuple(
        (
            value_label(result.before.response.model, parameter.name),
            with_unit(with_U(parameter.prior, 2 * parameter.prior_sd), parameter.name),
            with_unit(with_U(parameter.value, 2 * parameter.sd), parameter.name),
            shift_words(parameter),
        )
        for parameter in moved[:most]
    )
    rest = len(moved) - most
    more = f" The other {rest} moved less." if rest > 0 else ""
    note = f"± is U, k = 2. Those that moved furthest come first.{more} model.toml holds them all."
    return Table("Fitted values against their priors", note, ("Model value", "in its file", "fitted", "moved by"), rows)


def _pairs(of: Sequence[tuple[float, float]]) -> str:
    """Return pairs of frequency and damping as text: `750.4 Hz, 0.01; 5999 Hz, 0.7`."""
    return "; ".join(f"{number(f)} Hz, {ratio:.2g}" for f, ratio in of)


LINES, COLUMNS = 24, 80  # of a terminal


def summary(serial: str, r: Result, added: Sequence[AddedElement] = ()) -> list[str]:
    """Return at most 24 lines of 80 columns for a terminal; the gap itself is never cut. added: elements that were
    added to the improved model, in lines of their own."""
    lines = _wrap(f"{title(serial, r)} (model {r.model}, damping {r.damping})", "")
    more, kept = (list(_lines(blocks)) for blocks in short_report(r))
    room = LINES - len(lines) - len(kept)
    cut = [] if len(more) <= room else ["  ... for the rest see gap.json and gap.pdf"]
    return [*lines, *more[: room - len(cut)], *cut, *kept, *(_lines([elements(added)]) if added else ())]


def _lines(blocks: Sequence[Block]) -> Iterator[str]:
    for block in blocks:
        match block:
            case Heading():
                yield from _wrap(f"{block.words}:", "  ")
            case Sentence():
                yield from _wrap(block.words, "  ", most=2 if block.role is Role.UNNAMED else None)
                yield from _wrap(block.more, "    ")
            case Table():
                yield from _wrap(block.note, "  ")
                for first, *rest in block.rows:
                    cells = ", ".join(f"{head} {cell}" for head, cell in zip(block.head[1:], rest, strict=True))
                    yield from _wrap(f"{first}: {cells}", "    ", most=2)


def _wrap(words: str, indent: str, most: int | None = None) -> list[str]:
    return textwrap.wrap(
        words,
        COLUMNS,
        initial_indent=indent,
        subsequent_indent=indent + "  ",
        break_on_hyphens=False,
        max_lines=most,
        placeholder=" ...",
    )


def render_html(serial: str, result: Result, added: Sequence[AddedElement] = ()) -> bytes:
    """Return the page. Raises PictureError if plotly is not installed."""
    words, tables = [f"Model {result.model}, damping {result.damping}."], []
    for block in report(result, added):
        match block:
            case Heading():
                words.append(block.words)
            case Sentence():
                words += [block.words, *filter(None, [block.more])]
            case Table():
                tables.append(block)
    return page(pictures(result, added), title(serial, result), words, tables)
