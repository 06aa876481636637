"""Tables of the gap report: the gap by channel, the explanations that were tried and why each was named or not, fitted
values, added elements. gap.pdf and gap.html show the same."""

from collections.abc import Sequence
from math import isfinite

from accept.gap.empirical import AddedElement
from accept.gap.reasons import candidates, moved_parameters, shift_words
from accept.gap.text import TWO, gap_number, number, symbol, unit, words_of
from accept.models.value_labels import value_label
from accept.pictures.interactive import PageTable
from checks.fitting import identifiability_of_effects, likelihood_profile
from checks.gap import Result, channel_errors
from checks.rounding import rounded, with_U
from specs.units import with_unit

G_NOTE = (
    "G: squared residual over noise variance plus squared tolerance, per degree of freedom; 1 or less is agreement."
)
LEVEL_NOTE = "Level and phase: rms of what is left over"
PARAMETERS, LEAST_PARAMETERS = 16, 6  # of the fitted values, those that moved furthest: what the page has room for


def tables(result: Result, added: Sequence[AddedElement] = ()) -> dict[str, PageTable]:
    """Return the tables that have rows by subject, in order: "gap", "steps", "reasons", "identified", "added",
    "fitted"."""
    steps, identified = _steps(result), _identifiability(result)
    found = {
        "gap": _gap(result),
        "steps": steps,
        "reasons": _candidates(result),
        "identified": identified,
        "added": _elements(added),
        "fitted": _fitted_values(result, max(LEAST_PARAMETERS, PARAMETERS - len(steps.rows) - len(identified.rows))),
    }
    return {name: table for name, table in found.items() if table.rows}


def _gap(result: Result) -> PageTable:
    off = channel_errors(result)
    rows = []
    for c, before in result.gap_before.channels.items():
        dB, deg, dB_after, deg_after = off[c]
        row = (c, gap_number(before.G), gap_number(result.gap_after.channels[c].G))
        rows.append((*row, f"{dB:.3g} dB", f"{dB_after:.3g} dB", f"{deg:.3g} deg", f"{deg_after:.3g} deg"))
    if not result.named:
        once = tuple((row[0], row[1], row[3], row[5]) for row in rows)  # after is before
        return PageTable("The gap by channel", f"{G_NOTE} {LEVEL_NOTE}.", ("Channel", "G", "level", "phase"), once)
    note = (
        f"{G_NOTE} G before: the lowest that the model reaches without the named effects, fitted again. "
        f"{LEVEL_NOTE}{_before_note(result)}."
    )
    head = ("Channel", "G before", "G after", "level before", "after", "phase before", "after")
    return PageTable("The gap by channel", note, head, tuple(rows))


def _before_note(result: Result) -> str:
    """Return a note on the values behind the map and the curves before, if these are not the values behind G before."""
    alike = bool(result.before.names) or not result.named
    return "" if alike else ". Their before, as on the map: the named effects removed, all other values unchanged"


def _steps(result: Result) -> PageTable:
    """Return G by channel after each named effect, if there are several; the last row is the remaining gap."""
    steps = result.steps if len(result.steps) > TWO else ()
    channels = list(result.gap_before.channels)
    rows = tuple(
        (
            "nothing named" if s.effect is None else f"then {words_of(s.effect)}",
            *(gap_number(s.channels[c]) for c in channels),
        )
        for s in steps
    )
    note = "G at the values of the whole explanation, the effects in order of what each explains. Last: what is left."
    return PageTable("The gap, step by step", note, ("With", *(f"G {c}" for c in channels)), rows)


def _candidates(result: Result) -> PageTable:
    note = "On records that were not fitted. p of the rest: the chance that noise and tolerance leave as much over."
    head = ("Explanation tried", "gain in ln L", "p of the rest", "decision")
    return PageTable("Why this cause, and why not another", note, head, tuple(candidates(result)))


def _identifiability(result: Result) -> PageTable:
    """Return how well the data determine each named value beside all others that were fitted."""
    note = (
        "By curvature: Fisher information at the optimum, priors included. By profile: where ln L has fallen by 1.92 "
        "with all other values fitted again. Wider: than if all others were known. Most alike: the most correlated."
    )
    head = ("Named value", "95 % by curvature", "95 % by profile", "wider by", "most alike")
    rows = []
    for name, it in identifiability_of_effects(result.fit, [n.effect for n in result.named]).items():
        effect, _, parameter = name.partition(".")
        label = f"{words_of(effect)}: {symbol(effect, parameter)} [{unit(effect, parameter) or '1'}]"
        ends = (result.fit.interval(name), likelihood_profile(result.fit, name).ci95)
        shown = (" to ".join(rounded(x, it.sd) if isfinite(x) else "open" for x in pair) for pair in ends)
        rival = value_label(result.after.response.model, it.rival)
        rows.append((label, *shown, f"{it.inflation:.3g}", f"{rival} ({it.correlation:+.3f})"))
    return PageTable("How well each named value is determined", note, head, tuple(rows))


def _elements(added: Sequence[AddedElement]) -> PageTable:
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
    return PageTable("Unidentified elements in the improved model", note, head, tuple(rows))


def _fitted_values(result: Result, most: int) -> PageTable:
    moved = moved_parameters(result)
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
    return PageTable(
        "Fitted values against their priors", note, ("Model value", "in its file", "fitted", "moved by"), rows
    )


def _pairs(of: Sequence[tuple[float, float]]) -> str:
    """Return pairs of frequency and damping as text: `750.4 Hz, 0.01; 5999 Hz, 0.7`."""
    return "; ".join(f"{number(f)} Hz, {ratio:.2g}" for f, ratio in of)
