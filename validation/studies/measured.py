"""Elements and filters hidden in the measured responses of a frame that another laboratory built, and the score of the
answers; with the two laboratories as they are.

    python -m validation.studies.measured --cases 40 --seed 11 --out out/measured

A threshold on the gain in log-likelihood is set on the other laboratory's frame, so that one null in a hundred passes.
"""

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from checks.arrays import Complex
from checks.fitting import Dataset
from checks.gap.structures import LinearAnswer, explain_linear
from validation.data.measured_frames import FLOORS, Z, exchanged, frame, southampton, swansea, with_element, with_filter
from validation.scoring.scores import wilson
from validation.scoring.scores_laboratory import upper_limit

Rng = np.random.Generator
UNKNOWN_REFERENCE = 0.5  # of Swansea's decibels
SOFTER = 0.775  # of the drawing: the answer for Southampton, with which the hidden effects are searched
NULLS = 40


@dataclass(frozen=True)
class Hidden:
    """name; kind and place of the answer; values by name of the answer; put: what it makes of a response."""

    name: str
    kind: str
    place: str
    values: Mapping[str, float]
    put: Callable[[Dataset], Dataset]


def _log(rng: Rng, lo: float, hi: float) -> float:
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def _nothing(_: Rng) -> Hidden:
    return Hidden("nothing", "", "", {}, lambda d: d)


def _on_floor(name: str, values: dict[str, float], z: Z) -> Hidden:
    return Hidden(name, name, "floor 1", values, lambda d: with_element(d, z))


def _mass(rng: Rng) -> Hidden:
    m = _log(rng, 0.8, 3.0)
    return _on_floor("mass", {"m_kg": m}, lambda s: m * s * s)


def _spring(rng: Rng) -> Hidden:
    k = _log(rng, 8e3, 4e4)
    return _on_floor("spring", {"k_N_per_um": 1e-6 * k}, lambda s: k + 0.0 * s)


def _damper(rng: Rng) -> Hidden:
    c = _log(rng, 20.0, 200.0)
    return _on_floor("damper", {"c_N_s_per_m": c}, lambda s: c * s)


def _resonator(rng: Rng) -> Hidden:
    m, f, ratio = _log(rng, 0.1, 0.5), _log(rng, 12.0, 28.0), _log(rng, 0.01, 0.05)
    w = 2.0 * np.pi * f

    def z(s: Complex) -> Complex:
        link = w * w + 2.0 * ratio * w * s
        return m * s * s * link / (s * s + link)

    return _on_floor("resonator", {"m_kg": m, "f_Hz": f, "damping_ratio": ratio}, z)


def _filter(name: str, rng: Rng, values: dict[str, float], factor: Z) -> Hidden:
    place = str(rng.choice([*FLOORS, "drive"]))
    on = FLOORS if place == "drive" else (place,)
    return Hidden(name, "filter", place, values, lambda d: with_filter(d, dict.fromkeys(on, factor)))


def _delay(rng: Rng) -> Hidden:
    tau = _log(rng, 3e-3, 12e-3)
    return _filter("delay", rng, {"tau_us": 1e6 * tau}, lambda s: np.exp(-s * tau))


def _gain(rng: Rng) -> Hidden:
    g = _log(rng, 1.4, 2.5) ** float(rng.choice([-1, 1]))
    return _filter("gain", rng, {"gain": g - 1.0}, lambda s: g + 0.0 * s)


def _lowpass(rng: Rng) -> Hidden:
    f = _log(rng, 8.0, 40.0)
    return _filter("low-pass", rng, {"f_Hz": f}, lambda s: 1.0 / (1.0 + s / (2.0 * np.pi * f)))


def _exchanged(rng: Rng) -> Hidden:
    a, b = sorted(int(i) for i in rng.permutation(3)[:2])
    return Hidden("exchanged", "fault", f"{FLOORS[a]} and {FLOORS[b]} are exchanged.", {}, lambda d: exchanged(d, a, b))


DRAWN = (_mass, _nothing, _delay, _spring, _gain, _resonator, _nothing, _lowpass, _damper, _exchanged)


def draw_case(seed: int, number: int) -> tuple[Hidden, Dataset, Dataset]:
    """Return what a case hides, and its two realisations."""
    rng = np.random.default_rng([seed, 51, number])
    hidden = DRAWN[number % len(DRAWN)](rng)
    A, B = map(hidden.put, southampton(number % 4))
    return hidden, A, B


def judged(hidden: Hidden, answer: LinearAnswer) -> dict[str, Any]:
    """Return how an answer compares with what was hidden. named: whether it says anything at all."""
    said = [(e.kind, {p.part for p in e.places}, e) for e in answer.elements]
    said += [("fault", {words}, None) for words in answer.faults]
    in_class = [s for s in said if hidden.place in s[1]]
    right = [s for s in in_class if s[0] == hidden.kind]
    covered = []
    for _, _, e in right[:1]:
        if e is not None:
            inside = (p.lo <= hidden.values[n] <= p.hi for n, p in e.parameters.items() if n in hidden.values)
            covered = [bool(x) for x in inside]
    return {
        "hidden": hidden.name,
        "place": hidden.place,
        "verdict": str(answer.verdict),
        "named": bool(said),
        "in_class": bool(in_class),
        "kind": bool(right),
        "false": len(said) > len(in_class),
        "class": max((len(s[1]) for s in said), default=0),
        "covered": covered,
        "gain": answer.gain if answer.elements else np.inf if said else 0.0,  # a fault needs no search
        "only_in": list(answer.only_in),
        "said": [e.sentence for e in answer.elements] + list(answer.faults),
        "values": dict(hidden.values),
    }


def threshold(nulls: int, seed: int) -> tuple[float, int]:
    """Return the gain that one null in a hundred of the other laboratory's frame passes, from halves of its lines drawn
    at random, and the number of these that said anything."""
    model, rng = frame(gain_sd=UNKNOWN_REFERENCE), np.random.default_rng([seed, 99])
    model = replace(model, sensors={c: model.sensors[c] for c in FLOORS[1:]})
    size, gains = swansea()[0].f.size * 2 - 1, []
    for _ in range(nulls):
        A, B = (d.select(FLOORS[1:]) for d in swansea(rng.permutation(size)))
        answer = explain_linear(model, A, B)
        gains.append(answer.gain if answer.elements or answer.faults else 0.0)
    return float(np.quantile(gains, 0.99, method="higher")), sum(g > 0.0 for g in gains)


def as_they_are() -> dict[str, LinearAnswer]:
    """Return the answers for the frames as the two laboratories measured them."""
    drawn, unscaled = frame(), frame(gain_sd=UNKNOWN_REFERENCE)
    two = replace(unscaled, sensors={c: unscaled.sensors[c] for c in FLOORS[1:]})
    A, B = swansea()
    return {
        "Southampton": explain_linear(drawn, *southampton(0)),
        "Swansea": explain_linear(unscaled, A, B),
        "Swansea, floors 2 and 3": explain_linear(two, A.select(FLOORS[1:]), B.select(FLOORS[1:])),
    }


def table(rows: Sequence[Mapping[str, Any]], least: float) -> list[str]:
    """Return the lines of the table: counts with Wilson's 95 % intervals."""

    def share(k: int, n: int) -> str:
        lo, hi = wilson(k, n)
        return f"{k} of {n} ({100 * lo:.0f} to {100 * hi:.0f} %)"

    hiding, bare = ([r for r in rows if (r["hidden"] == "nothing") == empty] for empty in (False, True))
    found = [r for r in hiding if r["named"]]
    covered = [v for r in found for v in r["covered"]]
    wrong = sum(r["false"] for r in rows)
    above = sum(r["kind"] and r["gain"] > least for r in hiding)
    lines = [
        f"false: {share(wrong, len(rows))}, at most {100 * upper_limit(wrong, len(rows)):.1f} % (one-sided 95 %)",
        f"nothing hidden, nothing said: {share(sum(not r['named'] for r in bare), len(bare))}",
        f"found: {share(len(found), len(hiding))}",
        f"place in the class, of those found: {share(sum(r['in_class'] for r in found), len(found))}",
        f"kind, of those found: {share(sum(r['kind'] for r in found), len(found))}",
        f"median size of the class: {np.median([r['class'] for r in found]):g}",
        f"values inside their 95 % interval: {share(sum(covered), len(covered))}",
        f"right at 1 % false positives (gain above {least:.1f}, set on the other frame): {share(above, len(hiding))}",
    ]
    for name in dict.fromkeys(r["hidden"] for r in rows):
        of = [r for r in rows if r["hidden"] == name]
        lines.append(
            f"  {name}: {len(of)}; named {sum(r['named'] for r in of)}, place {sum(r['in_class'] for r in of)}, kind "
            f"{sum(r['kind'] for r in of)}, false {sum(r['false'] for r in of)}"
        )
    return lines


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="measured", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=4 * len(DRAWN))
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--nulls", type=int, default=NULLS)
    parser.add_argument("--out", type=Path, default=Path("out/measured"))
    a = parser.parse_args(arguments)
    a.out.mkdir(parents=True, exist_ok=True)
    for name, answer in as_they_are().items():
        print(name, answer.verdict, [e.sentence for e in answer.elements], answer.faults, answer.only_in, flush=True)
    least, said = threshold(a.nulls, a.seed)
    print(f"threshold {least:.1f} from {a.nulls} nulls of the other frame, of which {said} said anything", flush=True)
    model, rows = frame(SOFTER), []
    for k in range(a.cases):
        hidden, A, B = draw_case(a.seed, k)
        start = time.process_time()
        row = judged(hidden, explain_linear(model, A, B)) | {"seconds": time.process_time() - start}
        rows.append(row)
        print(k, json.dumps(row), flush=True)
    (a.out / "rows.json").write_text(json.dumps(rows, indent=1))
    print("\n".join(table(rows, least)))


if __name__ == "__main__":
    main()
