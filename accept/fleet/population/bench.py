"""A learned bench as a section of a model file, as a document for scripts, and in sentences for people."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from checks.model import LATENCIES, LearnedBench
from checks.picture import Band, Line, Panel
from checks.population import Population
from checks.rounding import with_U
from specs.model import ModelSpec
from specs.model_sections import BenchOfChannel, LearnedBenchRecord

DIGITS = 4  # of what is written of a factor: its uncertainty is a hundredth of it at best
MATTERS = 0.005  # of a response: less is not worth a sentence
SURE = 4.0  # standard uncertainties: a thousand bins are looked at
MOST = 6  # bands of a channel
SHARP_OCTAVES = 0.5  # narrower than that is a resonance
EXPLAINED = (
    "Line: what the bench multiplies each channel by, less one, in every unit alike (real part; imaginary part "
    "dashed). Shaded: how far one more unit may differ from it, two standard deviations. Where the shade is wide, "
    "units differ, and the records of a unit say little there."
)


@dataclass(frozen=True)
class Feature:
    """A band in which the bench changes a channel: by how much at most (relative), at which frequency, and u there."""

    channel: str
    f_lo_Hz: float
    f_hi_Hz: float
    at_Hz: float
    size: float
    u: float

    @property
    def sharp(self) -> bool:
        return bool(np.log2(self.f_hi_Hz / self.f_lo_Hz) < SHARP_OCTAVES)


def bench_record(found: Population, learned_on: str | None) -> LearnedBenchRecord | None:
    """Return the section of the model file; None if no bench was learned."""
    if found.bench is None:
        return None
    bench = found.bench.simplified()
    channels = {
        c: BenchOfChannel(
            real=[_short(v) for v in bench.factor[:, i].real],
            imag=[_short(v) for v in bench.factor[:, i].imag],
            sd=[_short(v) for v in bench.sd[:, i]],
            tolerance=[_short(v) for v in bench.tolerance[:, i]],
        )
        for i, c in enumerate(bench.channels)
    }
    return LearnedBenchRecord(
        f_Hz=[float(f"{f:.7g}") for f in bench.f],
        channels=channels,  # type: ignore[arg-type]
        units=[j.serial for j in found.judged if j.belongs],
        apart=[j.serial for j in found.judged if not j.belongs],
        learned_on=learned_on,
    )


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def latencies(found: Population) -> dict[str, tuple[float, float, float]]:
    """Return channel -> latency, its U (k = 2) and the value of the file, all in us."""
    sd = np.sqrt(np.diag(found.batch.mean_cov))
    at = {n: i for i, n in enumerate(found.names)}
    return {
        c: (float(found.batch.mean[at[n]]), 2.0 * float(sd[at[n]]), float(found.prior.mean[at[n]]))
        for c, n in LATENCIES.items()
        if n in at
    }


def features(bench: LearnedBench) -> list[Feature]:
    """Return the bands in which the bench changes a channel, beyond doubt and worth a sentence, the largest first. A
    band ends where its change falls to a quarter of the largest."""
    out: list[Feature] = []
    for i, channel in enumerate(bench.channels):
        size, u = np.abs(bench.factor[:, i]), bench.sd[:, i]
        left = (size > MATTERS) & (size > SURE * u)
        while left.any() and len(out) < MOST * (i + 1):
            k = int(np.argmax(np.where(left, size, 0.0)))
            beyond = np.flatnonzero(size < size[k] / 4.0)
            before, after = beyond[beyond < k], beyond[beyond > k]
            a = int(before[-1]) + 1 if before.size else 0
            b = int(after[0]) - 1 if after.size else size.size - 1
            out.append(Feature(channel, bench.f[a], bench.f[b], bench.f[k], float(size[k]), float(u[k])))
            left[a : b + 1] = False
    return sorted((f for f in out if f.f_hi_Hz > f.f_lo_Hz), key=lambda f: -f.size)


def median_gaps(found: Population) -> dict[str, tuple[float, float]]:
    """Return by channel the median G over the units that belong to the batch: without the learned bench, and with the
    bench and the values that the other units predict."""
    belong = [j for j in found.judged if j.belongs]
    channels = dict.fromkeys(c for j in belong for c in j.G_left_out)
    return {
        c: (
            float(np.median([j.G_before[c] for j in belong if c in j.G_before])),
            float(np.median([j.G_left_out[c] for j in belong if c in j.G_left_out])),
        )
        for c in channels
    }


def bench_lines(found: Population, changed: Sequence[str] = ()) -> list[str]:
    """Return the findings about the bench, a sentence or two a line, each with its remedy."""
    out = []
    late = latencies(found)
    sure = {c: v for c, v in late.items() if abs(v[0] - v[2]) > v[1] and abs(v[0] - v[2]) > 1.0}
    for c, (tau, U, of_file) in sure.items():
        out.append(
            f"{c} is sampled {with_U(abs(tau - of_file), U)} us {'later' if tau > of_file else 'earlier'} than the "
            "model file says, in every unit: converter, interpolator, amplifier and filter together."
        )
    if sure:
        out.append(
            "The learned model takes these latencies into account. If a setting of the converter or a filter is the "
            "cause, change it and learn again; else state them under [bench.latency_us]."
        )
    for f in features(found.bench)[:4] if found.bench is not None else []:
        band = f"{f.f_lo_Hz:.0f} to {f.f_hi_Hz:.0f} Hz"
        what = (
            "a resonance of the bench: check the guide of the payload and how the encoder is held"
            if f.sharp
            else "no resonance: check gains, filters and the payload's guide"
        )
        out.append(
            f"{f.channel} differs from the model by up to {percent(f.size)} ({f.at_Hz:.0f} Hz) from {band}, in every "
            f"unit alike. Its cause is unknown. This looks like {what}."
        )
    for c, (before, after) in median_gaps(found).items():
        if before > 1.0:
            out.append(f"G of {c}, median of the units: {before:.3g} without what was learned, {after:.2g} with it.")
    return [*out, *changed]


def bench_document(found: Population, learned_on: str | None, changed: Sequence[str] = ()) -> dict[str, Any]:
    """Return the same for scripts."""
    bench = found.bench
    return {
        "learned_on": learned_on,
        "latencies": {c: {"tau_us": tau, "U": U, "file_us": file} for c, (tau, U, file) in latencies(found).items()},
        "features": [asdict(f) for f in (features(bench) if bench is not None else [])],
        "G": {c: {"without": before, "with": after} for c, (before, after) in median_gaps(found).items()},
        "changed": list(changed),
    }


def percent(part: float) -> str:
    """Return a fraction in percent, with two digits."""
    return f"{float(f'{100.0 * part:.2g}'):g} %"


def changes_since(old: ModelSpec, found: Population) -> list[str]:
    """Return what differs from an earlier bench beyond the uncertainty of both, or one line that nothing does."""
    was = old.learned_bench
    if was is None or found.bench is None:
        return []
    day = f" of {was.learned_on}" if was.learned_on else ""
    out = []
    for c, (tau, U, _) in latencies(found).items():
        before, sd = old.values.get(LATENCIES[c]), old.sds.get(LATENCIES[c], 0.0)
        if before is not None and abs(tau - before) > np.hypot(U, 2.0 * sd):
            out.append(f"Since the bench{day}: the latency of {c} went from {before:.4g} to {with_U(tau, U)} us.")
    f = np.array(was.f_Hz)
    for c, of_channel in was.channels.items():
        if c not in found.bench.channels:
            continue
        i = found.bench.channels.index(c)
        now, u = (np.interp(f, found.bench.f, x) for x in (np.abs(found.bench.factor[:, i]), found.bench.sd[:, i]))
        new = np.asarray(found.bench.at(f, c)) - 1.0
        away = np.abs(new - (np.array(of_channel.real) + 1j * np.array(of_channel.imag)))
        limit = 3.0 * np.hypot(u, of_channel.sd) + MATTERS
        k = int(np.argmax(away / limit))
        if away[k] > limit[k]:
            out.append(
                f"Since the bench{day}: {c} changed by {percent(away[k])} at {f[k]:.0f} Hz, to {percent(now[k])}."
            )
    return out or [f"Since the bench{day} nothing changed beyond its uncertainty."]


def bench_panels(bench: LearnedBench) -> list[Panel]:
    """Return the effect of the bench on each channel, in percent, with the tolerance for one more unit."""
    out = []
    for i, c in enumerate(bench.channels):
        d, wide = 100.0 * bench.factor[:, i], 200.0 * np.hypot(bench.sd[:, i], bench.tolerance[:, i])
        most = float(np.clip(1.2 * np.quantile(np.abs(d) + wide, 0.98), 1.0, 60.0))
        shade = Band(bench.f, np.clip(d.real - wide, -most, most), np.clip(d.real + wide, -most, most), role="model")
        items = (
            shade,
            Line(bench.f, np.clip(d.real, -most, most), role="data"),
            Line(bench.f, np.clip(d.imag, -most, most), style="dashed", role="quiet"),
        )
        out.append(Panel(c, "f [Hz]", "%", items, x_log=True, y_range=(-most, most)))
    return out
