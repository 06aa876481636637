"""What the gap workflow found, in words for the terminal, the report and the certificate."""

from collections.abc import Mapping
from typing import Any

from checks.gap.result import AMBIGUOUS, EXPLAINED, NO_MISSING, PARTLY, UNEXPLAINED, Named, Result

REFUSED = "refused"  # stands in `verdict` where the workflow gave none; `reason` says why
HEADLINE = {
    NO_MISSING: "Nothing is missing from the model",
    EXPLAINED: "Explained",
    AMBIGUOUS: "Explained, but not by one effect alone",
    PARTLY: "Partly explained",
    UNEXPLAINED: "Something is missing that has no name",
}


def number(x: float) -> str:
    """Four digits, plain where that is readable."""
    return f"{x:.4g}"


def chance(p: float) -> str:
    return "< 1e-12" if p < 1e-12 else f"{p:.2g}"


def named_line(n: Named) -> str:
    """Name, then every parameter with its interval."""
    values = ", ".join(f"{k} = {number(v.value)} [{number(v.lo)}, {number(v.hi)}]" for k, v in n.parameters.items())
    return f"{n.effect}: {values}" if values else n.effect


def summary(serial: str, r: Result) -> list[str]:
    """At most 24 lines for a terminal."""
    lines = [f"{serial}: {r.verdict} - {HEADLINE[r.verdict]} (model {r.model}, damping {r.damping})"]
    lines += [f"  {n.sentence}" for n in r.named[:4]]
    lines += [f"    {named_line(n)}  p {chance(n.p)}" for n in r.named[:4]]
    lines += [f"  not told apart: {', '.join(a.effects)}; {a.experiment}" for a in r.ambiguous[:2]]
    for u in r.unnamed[:3]:
        poles = ", ".join(f"{f:.1f}" for f in u.poles_Hz) or "none"
        level = ", depends on the level" if u.level_dependent else ""
        lines.append(f"  without a name: {u.channel}, poles {poles} Hz{level}")
    if r.where and r.verdict != EXPLAINED:
        w = r.where[0]
        lines.append(f"  worst: {w.channel}, {w.f_lo_Hz:.0f} to {w.f_hi_Hz:.0f} Hz, {w.excess_dB:.0f} dB above chance")
    lines.append("  gap on unseen records, before -> after:")
    for c, before in r.gap_before.channels.items():
        lines.append(f"    {c}: G {number(before.G)} -> {number(r.gap_after.channels[c].G)}")
    if r.detection_limits:
        parts = [f"{k} {number(list(v.values())[-1])}" for k, v in r.detection_limits.items()]
        lines += ["  would have been seen (90 % power), from:"]
        lines += ["    " + ", ".join(parts[k : k + 4]) for k in range(0, len(parts), 4)]
    lines += [f"  note: {note}" for note in r.notes[:2]]
    return lines[:24]


def one_line(document: Mapping[str, Any]) -> str:
    """A judged unit's key `gap` in a line: what is missing, and the gap before and after where it was widest."""
    if document["verdict"] == REFUSED:
        return f"not held against model {document['start']}: {document['reason']}"
    if document["verdict"] == NO_MISSING:
        worst = max(document["gap_after"]["channels"].values())
        return f"fits model {document['model']} (largest G {worst:.2g})"
    parts = [_named(n) for n in document["named"]]
    parts += [f"{' or '.join(a['effects'])}, not told apart" for a in document["ambiguous"]]
    parts += [f"something without a name on {u['channel']}{_pole(u)}" for u in document["unnamed"]]
    words = document["verdict"].replace("_", " ")
    return f"does not fit model {document['model']}, {words}: {'; '.join(parts)}; gap {gap_of(document)}"


def gap_of(document: Mapping[str, Any]) -> str:
    """`de 81.0 -> 1.02`: of the channel that fitted worst."""
    before, after = (document[key]["channels"] for key in ("gap_before", "gap_after"))
    worst = max(before, key=lambda c: before[c])
    return f"{worst} {number(before[worst])} -> {number(after[worst])}"


def _named(n: Mapping[str, Any]) -> str:
    values = " ".join(f"{k} {p['value']:.3g}" for k, p in n["parameters"].items())
    return f"{n['effect']} {values}".rstrip()


def without_a_name(u: Mapping[str, Any]) -> str:
    """Channel, poles and zeros of an entry of `unnamed`, and what was tried for it."""
    poles, zeros = (", ".join(f"{f:.1f} Hz" for f in u[key]) or "none" for key in ("poles_Hz", "zeros_Hz"))
    level = ", depends on the level" if u["level_dependent"] else ""
    return f"{u['channel']}, poles {poles}, zeros {zeros}{level}. {u.get('words', '')}".strip()


def _pole(u: Mapping[str, Any]) -> str:
    return f" ({u['poles_Hz'][0]:.1f} Hz)" if u["poles_Hz"] else ""
