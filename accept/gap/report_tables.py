"""Tables of the gap report: the gap by channel, the explanations that were tried and why each was named or not, fitted
values, added elements. gap.pdf and gap.html show the same."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from accept.gap.empirical import AddedElement
from accept.gap.reasons import candidates, moved_parameters, shift_words
from accept.gap.sentences import G_NOTE, gap_by_channel
from accept.gap.text import gap_number, number, subject, symbol, unit, words_of
from accept.models.value_labels import value_label
from accept.pictures.blocks import Table
from checks.fitting import identifiability_of_effects, likelihood_profile
from checks.gap import Result, channel_errors
from checks.rounding import rounded, with_U
from specs.units import with_unit

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
    for name, it in identifiability_of_effects(result.fit, [n.effect for n in result.named]).items():
        effect, _, parameter = name.partition(".")
        label = f"{words_of(effect)}: {symbol(effect, parameter)} [{unit(effect, parameter) or '1'}]"
        ends = (result.fit.interval(name), likelihood_profile(result.fit, name).ci95)
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
