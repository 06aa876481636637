"""Effects that several units have in common belong to the bench, those of a single unit to that strut."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from accept.gap.text import number, value_words, words_of
from checks import distributions as stats
from checks.gap import GapVerdict
from checks.quantity import TWO_SIDED_95

Document = Mapping[str, Any]

SAME = 1e-3  # chance of such a spread of a parameter, were it the same in all units
# Nothing is missing beyond what is named: an effect that is not named is not there.
SETTLED = (GapVerdict.NO_MISSING, GapVerdict.EXPLAINED)


def are_settled(documents: Iterable[Document | None]) -> bool:
    """Return whether nothing is missing beyond what is named in any unit; None: of a unit that was refused."""
    return all(document is not None and document["verdict"] in SETTLED for document in documents)


def common(documents: Sequence[Document]) -> dict[str, Any]:
    """Return the effects of the bench and those of single struts, from gap.json of every unit.

    An effect is of the bench (`common`) if more than half of the units, and at least two, have it with one value, and
    no explained unit lacks it. A unit that is not explained may have it unseen: it is in `undecided`."""
    entries_of: dict[str, list[Document]] = defaultdict(list)
    for document in documents:
        for named in document["named"]:
            entries_of[named["effect"]].append({**named, "serial": document["serial"]})
    shared: list[dict[str, Any]] = []
    single: list[dict[str, Any]] = []
    for effect, entries in sorted(entries_of.items()):
        row = _row(effect, entries, documents)
        (shared if _of_the_bench(row, documents) else single).append(row)
    return {"units": [d["serial"] for d in documents], "common": shared, "single": single}


def lines(found: Mapping[str, Any]) -> list[str]:
    """Return the effects as text, a line for each."""
    out = [f"fleet of {len(found['units'])}: {', '.join(found['units'])}"]
    for row in found["common"]:
        values = ", ".join(
            f"{value_words(row['effect'], k, p['value'])} [{number(p['lo'])}, {number(p['hi'])}]"
            for k, p in row["parameters"].items()
        )
        out.append(f"  of the bench: {words_of(row['effect'])} {values} (in {', '.join(row['serials'])})")
        if row["undecided"]:
            out.append(f"    undecided for {', '.join(row['undecided'])}: other effects remain unexplained there")
    for row in found["single"]:
        differ = ", values differ" if row["without"] == [] and len(row["serials"]) > 1 else ""
        out.append(f"  of single struts: {words_of(row['effect'])} (in {', '.join(row['serials'])}{differ})")
    return out if len(out) > 1 else [*out, "  no effect was named"]


def _of_the_bench(row: Mapping[str, Any], documents: Sequence[Document]) -> bool:
    many = len(row["serials"]) >= max(2, len(documents) // 2 + 1)
    return many and not row["without"] and all(p["p_same"] > SAME for p in row["parameters"].values())


def _row(effect: str, entries: Sequence[Document], documents: Sequence[Document]) -> dict[str, Any]:
    serials = [e["serial"] for e in entries]
    absent = [d for d in documents if d["serial"] not in serials]
    return {
        "effect": effect,
        "serials": serials,
        "without": [d["serial"] for d in absent if d["verdict"] in SETTLED],
        "undecided": [d["serial"] for d in absent if d["verdict"] not in SETTLED],
        "parameters": {n: _mean([e["parameters"][n] for e in entries]) for n in entries[0]["parameters"]},
    }


def _mean(values: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Return the weighted mean, its 95 % interval, and the chance of the spread."""
    x = [float(v["value"]) for v in values]
    sd = [
        max((v["ci95"][1] - v["ci95"][0]) / (2 * TWO_SIDED_95), 1e-12 * max(abs(float(v["value"])), 1e-12))
        for v in values
    ]
    weight = [1.0 / s**2 for s in sd]
    mean = sum(w * v for w, v in zip(weight, x, strict=True)) / sum(weight)
    spread = sum(w * (v - mean) ** 2 for w, v in zip(weight, x, strict=True))
    half = TWO_SIDED_95 / sum(weight) ** 0.5
    p = float(stats.chi2.sf(spread, len(x) - 1)) if len(x) > 1 else 1.0
    return {"value": mean, "lo": mean - half, "hi": mean + half, "p_same": p}
