"""What the gap workflow found, in words for the terminal and the report."""

from checks.gap.result import AMBIGUOUS, EXPLAINED, NO_MISSING, PARTLY, UNEXPLAINED, Named, Result

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
