"""What several units have in common: an effect of all of them belongs to the bench, of one to that strut."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from scipy import stats

SAME = 1e-3  # chance of such a spread of a parameter, were it the same in all units
TWO_SIDED_95 = 1.96


def common(documents: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """From gap.json of every unit: effects that all have, with one value, and those of single struts."""
    seen: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for document in documents:
        for named in document["named"]:
            seen[named["effect"]].append({**named, "serial": document["serial"]})
    shared: list[dict[str, Any]] = []
    single: list[dict[str, Any]] = []
    for effect, entries in sorted(seen.items()):
        row = _row(effect, entries)
        everywhere = len(documents) > 1 and len(entries) == len(documents)
        (shared if everywhere and all(p["p_same"] > SAME for p in row["parameters"].values()) else single).append(row)
    return {"units": [d["serial"] for d in documents], "common": shared, "single": single}


def _row(effect: str, entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    names = entries[0]["parameters"]
    return {
        "effect": effect,
        "serials": [e["serial"] for e in entries],
        "parameters": {n: _mean([e["parameters"][n] for e in entries]) for n in names},
    }


def _mean(values: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Weighted mean, its 95 % interval, and the chance of the spread."""
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
