"""Requirements of the frequency response check on its data: settings, and the gates that end in no result."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from checks.acceptance.common.sampling_rate import SAMPLING
from checks.arrays import Array
from checks.cause import Cause, NoResult, Reason, because, together
from checks.declare import Setting
from checks.record import MOTIONS, Record
from checks.signals.record_checks import ChannelDelay, ExpectedSignal, dead, delay, mismatches, responds
from checks.signals.sampling_faults import sampling_faults
from checks.signals.spectral.frf import Frf
from specs.bench import GAIN_UM_PER_V, RECORDED_V, STATIC_HZ
from specs.spec import CheckSpec

OUTPUTS = ("Vs", "de", "da")
LOOKS = {  # plausible size of a channel of the bench: largest departure from its median, in V and m
    "Va": ExpectedSignal(1e-3, RECORDED_V),
    "Vs": ExpectedSignal(1e-3, RECORDED_V),
    "de": ExpectedSignal(1e-9, 4e-4),
    "da": ExpectedSignal(1e-9, 4e-4),
}
PREFIXES = {"um": 1e-6, "nm": 1e-9, "mm": 1e-3}  # the likeliest first
LOOKED_AT = 16  # every 16th sample suffices for the size of a channel
DELAY_HZ = (350.0, 1000.0)  # above the resonances that carry the response: phase is 0 or 180 degrees but for the delay
EXCUSED_ZERO, EXCUSED_POLE = 0.2, 0.1  # around the zero of Vs and the resonance coherence may drop ([STB] 3.2.4)
THIRD_OCTAVE, SIXTH_OCTAVE = 2.0 ** (1 / 3), 2.0 ** (1 / 6)
STEPS = 200  # from the lowest to the highest frequency


@dataclass(frozen=True)
class ResponseSettings:
    """Settings of the check; see SETTINGS for their meaning."""

    payload_kg: float
    payload_within: float
    scale_within: float
    bands_within: float
    gain_um_per_V: tuple[float, float]
    segment_s: float
    duration_min_s: float
    resonance_Hz: tuple[float, float]
    zero_Hz: tuple[float, float]
    coherence_min: float
    coherence_Hz: Mapping[str, tuple[float, float]]
    polarity: Mapping[str, int]
    delay_max_samples: float
    offset_max_samples: float
    second_share: float
    spurious_Hz: tuple[float, ...]
    spurious_within: float
    model: str


def _pair(values: Iterable[float]) -> tuple[float, float]:
    lo, hi = (float(v) for v in values)
    return lo, hi


_AS_TYPED: Mapping[Any, Callable[[Any], Any]] = {
    float: float,
    str: str,
    tuple[float, float]: _pair,
    tuple[float, ...]: lambda given: tuple(map(float, given)),
}


def rules_of(spec: CheckSpec) -> ResponseSettings:
    """Return the settings of the check in a spec."""
    get: dict[str, Any] = {s.name: spec.settings.get(s.name, s.default) for s in SETTINGS}
    plain = {name: _AS_TYPED[of](get[name]) for name, of in get_type_hints(ResponseSettings).items() if of in _AS_TYPED}
    return ResponseSettings(
        **plain,
        coherence_Hz={c: _pair(get[f"coherent_{c}_Hz"]) for c in OUTPUTS},
        polarity=dict(zip(OUTPUTS, (int(v) for v in get["polarity"]), strict=True)),
    )


def vet_records(records: Mapping[str, Record], rules: ResponseSettings) -> None:
    """Raise NoResult if a record is too short, or if its channels do not look like their names."""
    for key, record in records.items():
        seconds = record.t.size / record.fs
        if seconds < 0.999 * rules.duration_min_s:
            short = because(Cause.RECORD_SHORT, seconds=seconds, needed=rules.duration_min_s)
            raise NoResult(short.within(key, record.name))
        sizes = _wrong_sizes(_sampled_columns(record))
        if wrong := dead_channels(record) or list(sizes) or list(sampling_faults(record)):  # the first kind of fault
            raise NoResult(together(wrong).within(key, record.name))


def dead_channels(record: Record) -> list[Reason]:
    """Return a reason for each constant channel."""
    still = [n for n, x in _sampled_columns(record).items() if dead(n, x)]  # the whole is sorted only if a part is so
    return [reason for n in still for reason in dead(n, record[n])]


def record_faults(record: Record) -> list[Reason]:
    """Return the reasons why no model can be compared with a record: a motion in another unit, or faults of sampling.
    The comparison itself names dead, reversed and exchanged channels."""
    return unusable_units(record) or list(sampling_faults(record))


def unusable_units(record: Record) -> list[Reason]:
    """Return a reason for each motion of a record that is plausible only in nm, um or mm."""
    return [r for r in _wrong_sizes(_sampled_columns(record)) if r.cause is Cause.CHANNEL_UNIT]


def size_faults(record: Record) -> list[Reason]:
    """Return a reason for each channel of the bench, in V or m, whose size does not fit its name."""
    columns = {
        n: x for n, x in _sampled_columns(record).items() if record.units.get(n) == ("m" if n in MOTIONS else "V")
    }
    return list(_wrong_sizes(columns))


def _sampled_columns(record: Record) -> dict[str, Array]:
    """Return some samples of every known channel, enough to judge its size."""
    return {n: record[n][::LOOKED_AT] for n in LOOKS if n in record.channels}


def _wrong_sizes(columns: Mapping[str, Array]) -> Iterator[Reason]:
    """Yield a reason for each channel of implausible size, with the unit in which it would be plausible."""
    for reason in mismatches(columns, LOOKS):
        channel, value = reason.parameters["channel"], reason.parameters.get("value", 0.0)
        expected = LOOKS[channel]
        fitting = [unit for unit, m in PREFIXES.items() if expected.lo <= m * value <= expected.hi]
        if reason.cause is Cause.CHANNEL_SIZE and channel in MOTIONS and fitting:
            about = {"value": value, "hi": expected.hi, "unit": "m", "guess": fitting[0]}
            yield because(Cause.CHANNEL_UNIT, channel=channel, **about)
        else:
            yield reason


def vet_responses(key: str, file: str, frf: Frf) -> None:
    """Raise NoResult if a channel does not follow the drive anywhere."""
    still = [c for c in frf.channels if not responds(frf, c)]
    if still:
        reasons = [because(Cause.CHANNEL_NOT_DRIVEN, channel=c, reference=frf.input) for c in still]
        raise NoResult(together(reasons).within(key, file))


def vet_signs(frf: Frf, rules: ResponseSettings) -> None:
    """Raise NoResult if channels are reversed: the sign of their static gain is not that of the bench."""
    reversed_ = []
    low = frf.band(*STATIC_HZ)
    for c in frf.channels:
        wanted = rules.polarity[c]
        H, var = low.H[:, low.index(c)], low.var[:, low.index(c)]
        significant = np.isfinite(var) & (np.abs(H) ** 2 > 25.0 * var)
        if wanted and significant.any() and np.sign(np.sum(H[significant].real)) == -wanted:
            way = {1: "with", -1: "against"}
            found, expected = way[-wanted], way[wanted]
            reversed_.append(
                because(Cause.CHANNEL_REVERSED, channel=c, reference=frf.input, found=found, expected=expected)
            )
    if reversed_:
        raise NoResult(together(reversed_))


def outputs_of(records: Iterable[Record]) -> tuple[str, ...]:
    """Return the outputs common to all records: readers refuse a record without a channel of its product."""
    every = list(records)
    return tuple(c for c in OUTPUTS if all(c in record.channels for record in every))


def vet_scales(frf: Frf, rules: ResponseSettings) -> None:
    """Raise NoResult if the static gains of de and da disagree: both measure one payload's motion, and an encoder's arm
    or scale adds only percents."""
    if not set(MOTIONS) <= set(frf.channels):
        return
    low = frf.band(*STATIC_HZ)
    de, da = (np.abs(low.H[:, low.index(c)]) for c in ("de", "da"))
    usable = low.usable & (da > 0)
    if not usable.any():
        return
    ratio = float(np.median(de[usable] / da[usable]))
    if abs(ratio - 1) > rules.scale_within:
        raise NoResult(Cause.CHANNEL_SCALE, channel="de", other="da", ratio=ratio, within=rules.scale_within)


def vet_delays(frf: Frf, fs: float, rules: ResponseSettings) -> list[ChannelDelay]:
    """Return the delays of the channels behind the input. Raises NoResult if a channel comes before its cause or far
    too late, or if channels were stored with an offset between them."""
    delays = [d for d in (delay(frf, c, fs, *DELAY_HZ) for c in frf.channels) if d.seen]
    for d in delays:
        if d.samples < -0.5 - 3 * d.sd or d.samples > rules.delay_max_samples + 3 * d.sd:
            raise NoResult(
                Cause.CHANNEL_DELAYED,
                record="high",
                channel=d.channel,
                reference=d.reference,
                samples=d.samples,
                most=rules.delay_max_samples,
            )
    if not delays:
        return delays
    first, last = min(delays, key=lambda d: d.samples), max(delays, key=lambda d: d.samples)
    apart, sd = last.samples - first.samples, float(np.hypot(first.sd, last.sd))
    if apart > rules.offset_max_samples + 3 * sd:
        raise NoResult(
            Cause.CHANNEL_OFFSET,
            record="high",
            channel=last.channel,
            other=first.channel,
            samples=apart,
            most=rules.offset_max_samples,
        )
    return delays


def vet_coherence(frf: Frf, excused: Mapping[str, list[tuple[float, float]]], rules: ResponseSettings) -> None:
    """Raise NoResult if the median coherence of a third of an octave is below the gate, naming each.

    The median is used because a narrow dip at a zero is not a fault of the record; `excused` intervals do not count."""
    bad = [words for c in frf.channels for words in _bad_bands(frf, c, excused[c], rules)]
    if bad:
        more = f" and {len(bad) - 4} more" if len(bad) > 4 else ""
        raise NoResult(Cause.COHERENCE_LOW, needed=rules.coherence_min, bands=f"{'; '.join(bad[:4])}{more}")


def _bad_bands(frf: Frf, channel: str, excused: list[tuple[float, float]], rules: ResponseSettings) -> Iterator[str]:
    f, coherence = frf.f, frf.coherence[:, frf.index(channel)]
    counts = outside(f, excused)
    lo, hi = rules.coherence_Hz[channel]
    while lo < hi:
        top = min(lo * THIRD_OCTAVE, hi)
        band = (f >= lo) & (f <= top)
        inside = band & counts
        if not band.any():
            yield f"{channel} {lo:.3g} to {top:.3g} Hz (not measured)"
        elif inside.any() and not np.median(coherence[inside]) >= rules.coherence_min:
            yield f"{channel} {lo:.3g} to {top:.3g} Hz (median {np.median(coherence[inside]):.2f})"
        lo = top


def outside(f: Array, intervals: list[tuple[float, float]]) -> NDArray[np.bool_]:
    """Return (F,) frequencies in none of the intervals."""
    kept = np.ones(f.shape, dtype=bool)
    for lo, hi in intervals:
        kept &= (f < lo) | (f > hi)
    return kept


def coherent_up_to(frf: Frf, channel: str, excused: list[tuple[float, float]], rules: ResponseSettings) -> float | None:
    """Return the highest frequency [Hz] up to which the median coherence of a third of an octave stays above the gate.

    None if it is below the gate from the start."""
    counts = outside(frf.f, excused)
    f, good = frf.f[counts], frf.coherence[counts, frf.index(channel)] >= rules.coherence_min
    centres = np.geomspace(rules.coherence_Hz[channel][0], frf.f[-1], STEPS)
    first, last = np.searchsorted(f, centres / SIXTH_OCTAVE), np.searchsorted(f, centres * SIXTH_OCTAVE, side="right")
    passed = np.concatenate([[0], np.cumsum(good)])
    fails = np.flatnonzero(2 * (passed[last] - passed[first]) < last - first)
    end = int(fails[0]) if fails.size else STEPS
    return float(centres[end - 1]) if end else None


SETTINGS = (
    Setting("payload_kg", 5.7, "payload of the bench where the unit does not state its own", positive=True),
    Setting("payload_within", 0.2, "part by which the unit's payload may differ from that of the limits"),
    Setting("scale_within", 0.2, "part by which the static gains of de and da may differ"),
    Setting("bands_within", 0.15, "part by which both records may differ about their merging, and from their repeats"),
    Setting("gain_um_per_V", GAIN_UM_PER_V, "what a volt of Va may move de and da below the resonance"),
    SAMPLING,
    Setting("segment_s", 0.5, "length of the Hann segments of the curves and the coherence"),
    Setting("duration_min_s", 10.0, "shortest record that is used"),
    Setting("resonance_Hz", [70.0, 130.0], "where the axial resonance is searched"),
    Setting("zero_Hz", [25.0, 65.0], "where the zero of Vs is searched"),
    Setting("coherence_min", 0.9, "median coherence that every third of an octave needs"),
    Setting(
        "coherent_Vs_Hz",
        [10.0, 2000.0],
        "band in which Vs must be coherent, but for its zero and the resonance",
        positive=True,
    ),
    Setting("coherent_de_Hz", [10.0, 700.0], "band in which de must be coherent, but for the resonance", positive=True),
    Setting(
        "coherent_da_Hz", [10.0, 1000.0], "band in which da must be coherent, but for the resonance", positive=True
    ),
    Setting("polarity", [-1, 1, 1], "sign of the static gain of Vs, de and da; 0: either"),
    Setting("delay_max_samples", 5.0, "a channel further behind Va than this was stored with an offset"),
    Setting("offset_max_samples", 0.8, "two channels further apart than this were stored with an offset"),
    Setting("second_share", 0.05, "a second resonance counts from this part of the first one's flank beneath it"),
    Setting("spurious_Hz", [], "x-bending, y-bending and torsion of the strut as seen by de; empty: not searched"),
    Setting("spurious_within", 0.14, "how far around these frequencies a mode is searched"),
    Setting("model", "", "built-in model or TOML file that turns gains into ga and gs; empty: none"),
)
