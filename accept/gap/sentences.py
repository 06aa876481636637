"""What gap.json, or a judged unit's key `gap`, says was found, in blocks. Read without what searches and computes."""

from collections.abc import Mapping
from typing import Any

from accept.gap.text import chance, gap_number, parameters, poles_of, words_of
from accept.pictures.blocks import Role, Sentence, Table

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
