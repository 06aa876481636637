"""Struts with an element in the mechanics, which no effect of the library describes, and the score of the answers:
names that are false, place within the stated class, kind, values within their intervals.

    python -m validation.studies.elements --out out/elements --cases 14 --seed 7 --scatter 0.01

Kinds take turns, so that each occurs equally often; sizes are drawn evenly in their logarithm.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from accept.gap.analyse_unit import run_gap
from validation.bench import draw_setting
from validation.cases import Case
from validation.model_files import write_model
from validation.sets import DAMPING, Set
from validation.shell import draw_shell
from validation.strut import Attached, Hung, Loose, Strut, draw

Rng = np.random.Generator
UM = 1e-6


@dataclass(frozen=True)
class Truth:
    """kind and places (part, against) that are right; values by the names of gap.json."""

    kind: str
    places: tuple[tuple[str, str], ...]
    values: Mapping[str, float]
    point_mm: tuple[float, float] | None = None


def _log(rng: Rng, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def _holder(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    place, angle, r = str(rng.choice(["top", "bottom"])), rng.uniform(0, 2 * np.pi), rng.uniform(8e-3, 25e-3)
    at = (float(r * np.cos(angle)), float(r * np.sin(angle)))
    k = _log(rng, 0.08, 0.5) if place == "top" else _log(rng, 2.0, 10.0)
    m = _log(rng, 0.01, 0.06)
    truth = Truth("spring", ((f"{place} interface", "ground"),), {"k_N_per_um": k}, (1e3 * at[0], 1e3 * at[1]))
    return replace(strut, attached=(Attached(place, at=at, k=k / UM, m=m),)), truth


def _bellows(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    k = _log(rng, 0.06, 0.3)
    return replace(strut, attached=(Attached("payload", k=k / UM),)), Truth(
        "spring", (("payload", "ground"),), {"k_N_per_um": k}
    )


def _hung(rng: Rng, low: float, high: float, m: tuple[float, float]) -> Hung:
    return Hung(_log(rng, *m), _log(rng, low, high), _log(rng, 0.01, 0.05))


def _values(h: Hung) -> dict[str, float]:
    return {"m_kg": h.mass, "f_Hz": h.f_Hz, "damping_ratio": h.damping_ratio}


def _on_payload(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    h = _hung(rng, 40.0, 300.0, (0.03, 0.1))
    return replace(strut, attached=(Attached("payload", hung=h),)), Truth(
        "resonator", (("payload", "ground"),), _values(h)
    )


def _on_head(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    h, direction = _hung(rng, 120.0, 350.0, (0.008, 0.03)), int(rng.integers(1, 3))
    truth = Truth("resonator", (("head", "ground"), ("top interface", "ground")), {"f_Hz": h.f_Hz})
    return replace(strut, attached=(Attached("head", direction, hung=h),)), truth


def _damped_stack(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    c = _log(rng, 300.0, 2000.0)
    truth = Truth("damper", (("sensor stack", "across the sensor stack"),), {"c_N_s_per_m": c})
    return replace(strut, attached=(Attached("sensor", c=c),)), truth


def _loose(rng: Rng, strut: Strut) -> tuple[Strut, Truth]:
    side, kz = int(rng.choice([-1, 1])), rng.uniform(0.5, 0.75)
    loose = Loose(side, kz, rng.uniform(0.6, 0.9), rng.uniform(50, 300), rng.uniform(1e-3, 5e-3))
    where = (("bottom joint", "base"),) if side < 0 else (("top joint", "payload"),)
    return replace(strut, loose=loose), Truth("joint", where, {"kz_ratio": kz, "c_N_s_per_m": loose.cz})


def _dead(_: Rng, strut: Strut) -> tuple[Strut, Truth]:
    return replace(strut, dead=0.5), Truth("stack", (), {})


def _nothing(_: Rng, strut: Strut) -> tuple[Strut, Truth]:
    return strut, Truth("nothing", (), {})


DRAWN: Mapping[str, Callable[[Rng, Strut], tuple[Strut, Truth]]] = {
    "holder": _holder,
    "nothing": _nothing,
    "bellows": _bellows,
    "resonator": _on_payload,
    "loose joint": _loose,
    "cable": _on_head,
    "damped stack": _damped_stack,
    "dead stack": _dead,
}


def draw_cases(number: int, seed: int, scatter: float) -> list[tuple[str, Case, Truth]]:
    """Return units, each with what it hides; the draws of one do not depend on how many there are."""
    out = []
    for k in range(number):
        rng = np.random.default_rng([seed, 51, k])
        name = list(DRAWN)[k % len(DRAWN)]
        strut = draw(rng)
        if scatter:
            strut = replace(strut, built=draw_shell(rng, scatter, DAMPING))
        strut, truth = DRAWN[name](rng, strut)
        setting = replace(draw_setting(rng), seconds=12.0)
        out.append(
            (name, Case(f"E-{seed}-{k:03d}", "element", int(rng.integers(2**31)), strut, setting, {}, {}), truth)
        )
    return out


def judged(truth: Truth, gap: Mapping[str, Any]) -> dict[str, Any]:
    """Return how an answer compares with the truth."""
    found = gap.get("elements", [])
    right = [e for e in found if any((p["part"], p["against"]) in truth.places for p in e["places"])]
    values: list[bool] = []
    for e in right[:1]:
        if e["kind"] == truth.kind:
            for name, value in truth.values.items():
                if name in e["parameters"]:
                    lo, hi = e["parameters"][name]["ci95"]
                    values.append(bool(lo <= value <= hi))
    return {
        "false": [n["effect"] for n in gap.get("named", [])],
        "found": len(found),
        "in_class": bool(right),
        "class": len(found[0]["places"]) if found else None,
        "kind": bool(found) and found[0]["kind"] == truth.kind,
        "covered": values,
        "verdict": gap["verdict"],
    }


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="elements", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=len(DRAWN))
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--scatter", type=float, default=0.0, help="1 sd of the modes' frequencies from unit to unit")
    parser.add_argument("--out", type=Path, default=Path("out/elements"))
    a = parser.parse_args(arguments)
    a.out.mkdir(parents=True, exist_ok=True)
    model = write_model(Set(0, {}, a.scatter, a.scatter), a.out / "model")
    rows = []
    for name, case, truth in draw_cases(a.cases, a.seed, a.scatter):
        with tempfile.TemporaryDirectory(prefix="elements-") as parent:
            folder, start = case.write(Path(parent)), time.process_time()
            try:
                gap = run_gap(folder, model)
            except Exception as e:  # noqa: BLE001 a crash is what this has to count
                gap = {"verdict": f"{type(e).__name__}: {e}"}
        row = {"hidden": name, **judged(truth, gap), "seconds": time.process_time() - start}
        (a.out / f"{case.serial}.json").write_text(json.dumps([row, repr(truth), gap], indent=1))
        rows.append(row)
        print(case.serial, name, row, [e["sentence"] for e in gap.get("elements", [])], truth.values, flush=True)
    hiding = [r for r in rows if r["hidden"] not in ("nothing", "dead stack")]
    found = [r for r in hiding if r["found"]]
    covered = [v for r in found for v in r["covered"]]
    print(f"units {len(rows)}; false names {sum(bool(r['false']) for r in rows)}")
    print(f"found {len(found)} of {len(hiding)}; place in class {sum(r['in_class'] for r in found)}")
    print(f"kind {sum(r['kind'] for r in found)}; class sizes {sorted(r['class'] for r in found)}")
    print(f"values inside {sum(covered)} of {len(covered)}")
    print(f"nothing: {[(r['verdict'], r['found']) for r in rows if r['hidden'] == 'nothing']}")


if __name__ == "__main__":
    main()
