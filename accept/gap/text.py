"""The result of the gap workflow in words, for gap.pdf, the certificate and tables."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from accept.base.documents.analyses import REFUSED
from accept.pictures.blocks import Role, Sentence, Table
from checks.gap import GapVerdict
from checks.rounding import rounded

if TYPE_CHECKING:
    from checks.fitting import Fit
    from checks.gap import Parameter

FILTER = "filter"  # the kind of an element that lies in the signal path
AT_EDGE = " (at an end of the band: a slope that goes on outside looks like a pole there)"
HEADLINE: dict[str, str] = {
    GapVerdict.NO_MISSING: "Model and data agree",
    GapVerdict.EXPLAINED: "Cause found",
    GapVerdict.AMBIGUOUS: "Several causes are possible",
    GapVerdict.PARTLY: "Partly explained",
    GapVerdict.UNEXPLAINED: "Unidentified effect",
}


def headline_of_document(document: Mapping[str, Any]) -> str:
    """Return the headline of gap.json, or of a judged unit's key `gap`, such as `Cause found: misalignment`."""
    kinds = (f"something like a {e['kind']}" for e in document.get("elements", ()))
    named = ", ".join([*(words_of(n["effect"]) for n in document["named"]), *kinds])
    headline = HEADLINE[document["verdict"]]
    return f"{headline}: {named}" if named else headline


def subject(document: Mapping[str, Any]) -> str:
    """Return the words for what was found and added to the model, "" if nothing was."""
    named = bool(document.get("named"))
    elements = any(e["kind"] != FILTER for e in document.get("elements", ()))  # of which a model file holds none
    return " and ".join(["the named effects"] * named + ["the elements"] * elements)


def number(x: float) -> str:
    """Return four digits, without an exponent if that is readable."""
    return f"{x:.0f}" if 1e4 <= abs(x) < 1e6 else f"{x:.4g}"


def gap_number(G: float) -> str:
    """Return G with three digits at most."""
    return f"{G:.0f}" if 100.0 <= G < 1e5 else f"{G:.2g}"


def chance(p: float) -> str:
    """Return a probability as text; below 1e-12 it is not reliable and only bounded."""
    return "< 1e-12" if p < 1e-12 else f"{p:.2g}"


def words_of(effect: str) -> str:
    """Return an effect's name for readers: "sensor highpass" for `sensor_highpass`, which is its name in gap.json."""
    return effect.replace("_", " ")


def parameters(n: Mapping[str, Any]) -> str:
    """Return an entry of `named` in a line: the effect, then label, value with its unit and interval of each parameter,
    to two digits of half the interval: `loop delay: tau 30.1 us (29.8 to 30.4)`."""
    parts = []
    for name in in_order(n):
        value, (lo, hi) = n["parameters"][name]["value"], n["parameters"][name]["ci95"]
        at, low, high = (rounded(x, (hi - lo) / 2.0) for x in (value, lo, hi))
        with_unit = f"{at} {unit(n['effect'], name)}".rstrip()
        parts.append(f"{symbol(n['effect'], name)} {with_unit} ({low} to {high})")
    return f"{words_of(n['effect'])}{': ' if parts else ''}{'; '.join(parts)}"


def symbol(effect: str, parameter: str) -> str:
    """Return a parameter's name for readers: dx for `dx_um`, mass for `kg`, "damping ratio" for `damping_ratio`."""
    return _parameter(effect, parameter).symbol


def unit(effect: str, parameter: str) -> str:
    """Return the unit of a parameter, "" for a pure number."""
    return _parameter(effect, parameter).unit


def _parameter(effect: str, parameter: str) -> "Parameter":
    """Return the parameter as its effect declares it; for an effect that is not installed here, by its name."""
    from checks.gap import EFFECTS, Parameter  # loads slowly: only when an effect is named

    parameters = {p.name: p for p in EFFECTS[effect].parameters} if effect in EFFECTS else {}
    return parameters.get(parameter) or Parameter(parameter, lo=0.0, hi=0.0, off=0.0, start=0.0, scale=0.0)


def data_words(fit: "Fit") -> str:
    """Return the responses that a fit used, such as "Vs, de, da from 5 to 2000 Hz"."""
    data = fit.datasets[0]
    return f"{', '.join(data.channels)} from {data.f[0]:.0f} to {data.f[-1]:.0f} Hz"


def poles_of(poles_Hz: Iterable[float], ci95: Iterable[Iterable[float]], at_edge: bool) -> str:
    """Return the pole as text, `140.1 [139.8, 140.4] Hz`, with a warning if it lies at the end of the band."""
    ends = [tuple(each) for each in ci95]
    shown = [
        f"{f:.1f} [{ends[i][0]:.1f}, {ends[i][1]:.1f}]" if i < len(ends) else f"{f:.1f}" for i, f in enumerate(poles_Hz)
    ]
    if not shown:
        return "none"
    return f"{', '.join(shown)} Hz{AT_EDGE if at_edge else ''}"


def value_words(effect: str, name: str, value: float) -> str:
    """Return a parameter and its value, such as `dx 53.5 um`."""
    return f"{symbol(effect, name)} {number(value)} {unit(effect, name)}".rstrip()


def one_line(document: Mapping[str, Any]) -> str:
    """Return a unit's key `gap` in a line: missing effects, and the gap before and after in the worst channel."""
    if document["verdict"] == REFUSED:
        return f"not compared with model {document['start']}: {document['reason']}"
    if document["verdict"] == GapVerdict.NO_MISSING:
        worst = max(document["gap_after"]["channels"].values())
        return f"agrees with model {document['model']} (largest G {worst:.2g})"
    parts = [_effect_with_values(n) for n in document["named"]]
    parts += [f"{' or '.join(map(words_of, a['effects']))} (cannot be distinguished)" for a in document["ambiguous"]]
    parts += [e["sentence"].partition(";")[0] for e in document.get("elements", ())]
    poles = ((u["channel"], "".join(f" ({f:.1f} Hz)" for f in u["poles_Hz"][:1])) for u in document["unnamed"])
    parts += [f"unidentified effect on {channel}{pole}" for channel, pole in poles]
    explained = document["named"] or document["ambiguous"] or document.get("elements")
    head = f"{HEADLINE[document['verdict']].lower()}: " if explained else ""
    left = f"G of {gap_of(document)}" if explained else f"remaining G of {_worst_channel(document)}"
    return f"does not fit model {document['model']}; {head}{'; '.join(parts)}; {left}"


def gap_of(document: Mapping[str, Any]) -> str:
    """Return G before and after of the channel that fitted worst: `de 81.0 -> 1.02`."""
    before, after = (document[key]["channels"] for key in ("gap_before", "gap_after"))
    worst = max(before, key=lambda c: before[c])
    return f"{worst} {gap_number(before[worst])} -> {gap_number(after[worst])}"


def _worst_channel(document: Mapping[str, Any]) -> str:
    """Return the channel that is explained worst in the end and its G: `Vs 5.7`."""
    after = document["gap_after"]["channels"]
    worst = max(after, key=lambda c: after[c])
    return f"{worst} {gap_number(after[worst])}"


def _effect_with_values(n: Mapping[str, Any]) -> str:
    rounded_values = {k: float(f"{n['parameters'][k]['value']:.3g}") for k in in_order(n)}
    values = ", ".join(value_words(n["effect"], k, value) for k, value in rounded_values.items())
    return f"{words_of(n['effect'])} ({values})" if values else words_of(n["effect"])


def beside_truth(document: Mapping[str, Any], truth: Mapping[str, Mapping[str, float]]) -> str:
    """Return the named effects beside those that a simulated unit hides, the improved model, and the gap before and
    after. truth: effect -> its true values."""
    if not document.get("named"):
        return f"{one_line(document)} (hidden: {', '.join(truth)})"
    named = "; ".join(_compared(n, truth.get(n["effect"], {})) for n in document["named"])
    return f"{named}, added to the model ({document['improved']}); G of {gap_of(document)}"


def _compared(named: Mapping[str, Any], truth: Mapping[str, float]) -> str:
    effect, found, names = named["effect"], named["parameters"], in_order(named)
    values = ", ".join(f"{symbol(effect, k)} {round(found[k]['value'])} {unit(effect, k)}".rstrip() for k in names)
    true = ", ".join(f"{truth[k]:.0f}" if k in truth else "none" for k in names)
    return f"{words_of(effect)} {values} named (truth {true})"


def in_order(n: Mapping[str, Any]) -> list[str]:
    """Return the parameters of an entry of `named` as its effect declares them: stored JSON has them by name."""
    from checks.gap import EFFECTS  # the whole library: only if an effect was found

    declared = [p.name for p in EFFECTS[n["effect"]].parameters] if n["effect"] in EFFECTS else []
    return sorted(n["parameters"], key=lambda k: (declared.index(k) if k in declared else len(declared), k))


MISALIGNMENT = "misalignment"  # `accept misalign` estimates it too, from fewer data: the report says which these are
G_NOTE = "G: squared residual over noise and stated tolerance, on records that were not fitted; 1 or less agrees."


def findings(document: Mapping[str, Any], fitted_to: str = "") -> list[Sentence]:
    """Return what gap.json, or a judged unit's key `gap`, says was found: named effects, elements, rivals with the
    experiment that distinguishes them, and unidentified effects. fitted_to: the responses that a fit used."""
    out = []
    for n in document["named"]:
        data = [f"fitted to {fitted_to}"] if fitted_to and n["effect"] == MISALIGNMENT else []
        out.append(Sentence(n["sentence"], Role.FOUND, (parameters(n),), (f"p {chance(n['evidence']['p'])}", *data)))
    for e in document.get("elements", ()):
        out.append(Sentence(e["sentence"], Role.FOUND, (f"Next experiment: {e['experiment']}.",)))
    for a in document["ambiguous"]:
        effects = ", ".join(map(words_of, a["effects"]))
        out.append(Sentence(f"Cannot be distinguished: {effects}. Next experiment: {a['experiment']}.", Role.RIVAL))
    return out + [Sentence(f"Unidentified effect: {_unnamed(u)}", Role.UNNAMED) for u in document["unnamed"]]


def _unnamed(u: Mapping[str, Any]) -> str:
    """Return the channel, poles and zeros of an entry of `unnamed`, and the effects that were tried for it."""
    zeros = ", ".join(f"{f:.1f} Hz" for f in u["zeros_Hz"]) or "none"
    poles = poles_of(u["poles_Hz"], u.get("poles_ci95", ()), u.get("at_edge", False))
    level = ", depends on the level" if u["level_dependent"] else ""
    return f"{u['channel']}, poles {poles}, zeros {zeros}{level}. {u.get('words', '')}".strip()


def gap_by_channel(document: Mapping[str, Any]) -> Table:
    """Return the gap before and after, from gap.json or a judged unit's key `gap`."""
    before, after = (document[key]["channels"] for key in ("gap_before", "gap_after"))
    rows = tuple((c, gap_number(G), gap_number(after[c])) for c, G in before.items())
    return Table("The gap by channel", G_NOTE, ("Channel", "G before", "G after"), rows)
