"""Effects of data acquisition put upon the recorded strut S-01, in which nothing is hidden: as samples of its records,
so that every command sees the same. The effects are put on by formulas of their own."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.fft
from scipy import signal

from checks.arrays import Array, Complex
from checks.cause import Cause
from hw.records import mat_bytes
from tests.accept.gap.faulty_records import Columns, clipped, columns, held, jittered, lost, zeroed

EVERY = ("Vs", "de", "da")
LOW, REPEAT = "frf_noise.mat", "frf_noise_2.mat"
RECORDS = (LOW, "frf_noise_hf.mat", REPEAT, "frf_noise_hf_2.mat")
Spoil = Callable[[Columns], Columns]


@dataclass(frozen=True)
class AcquisitionEffect:
    """spoil: of one record; files: those it is put upon; cause: for which every command refuses it; names: what it may
    be called, alone or beside what the band does not tell from it; harmless: it may go unseen."""

    spoil: Spoil
    files: tuple[str, ...] = RECORDS
    cause: Cause | None = None
    names: frozenset[str] = frozenset()
    harmless: bool = False


def filtered(factor: Callable[[Array], Complex], *channels: str) -> Spoil:
    """Channels times a factor of the frequency; around its ends a record is periodic, which adds a free decay."""

    def spoil(c: Columns) -> Columns:
        f = scipy.fft.rfftfreq(c["t"].size, float(c["t"][1] - c["t"][0]))
        by = factor(f)
        return {k: scipy.fft.irfft(by * scipy.fft.rfft(x), x.size) if k in channels else x for k, x in c.items()}

    return spoil


def delay(seconds: float) -> Callable[[Array], Complex]:
    return lambda f: np.asarray(np.exp(-2j * np.pi * f * seconds))


def butterworth(order: int, corner_Hz: float) -> Callable[[Array], Complex]:
    b, a = signal.butter(order, 2.0 * np.pi * corner_Hz, analog=True)
    return lambda f: np.asarray(signal.freqs(b, a, 2.0 * np.pi * f)[1])


def second_order(corner_Hz: float, ratio: float = 0.7) -> Callable[[Array], Complex]:
    return lambda f: np.asarray(1.0 / (1.0 + 2j * ratio * f / corner_Hz - (f / corner_Hz) ** 2))


def highpass(corner_Hz: float, ratio: float = 0.7) -> Callable[[Array], Complex]:
    return lambda f: second_order(corner_Hz, ratio)(f) * -((f / corner_Hz) ** 2)


def drifting(share: float, *channels: str) -> Spoil:
    """A gain that rises by a share from the first sample to the last."""

    def spoil(c: Columns) -> Columns:
        gain = 1.0 + share * np.linspace(0.0, 1.0, c["t"].size)
        return {k: gain * x if k in channels else x for k, x in c.items()}

    return spoil


def two_modes(*channels: str) -> Spoil:
    """Motion of the bench at 178 and 182 Hz, 1 and 0.8 % of the static gain of 25 um/V."""

    def spoil(c: Columns) -> Columns:
        f = scipy.fft.rfftfreq(c["t"].size, float(c["t"][1] - c["t"][0]))
        H = sum(part * 25e-6 * second_order(at, 0.01)(f) for part, at in ((0.01, 178.0), (0.008, 182.0)))
        more = scipy.fft.irfft(H * scipy.fft.rfft(c["Va"]), c["t"].size)
        return {k: x + more if k in channels else x for k, x in c.items()}

    return spoil


ONE = (LOW,)
EFFECTS: Mapping[str, AcquisitionEffect] = {
    "gain drifts by 2 % in each record": AcquisitionEffect(drifting(0.02, *EVERY), harmless=True),
    "skew of 20 us on de": AcquisitionEffect(filtered(delay(20e-6), "de"), names=frozenset({"channel_latency_de"})),
    "skew of 20 us on Vs": AcquisitionEffect(filtered(delay(20e-6), "Vs"), names=frozenset({"channel_latency_Vs"})),
    "anti-alias filter on Vs": AcquisitionEffect(
        filtered(butterworth(4, 2500.0), "Vs"), names=frozenset({"channel_lowpass_Vs"})
    ),
    "clipped": AcquisitionEffect(clipped("de"), ONE, Cause.CHANNEL_CLIPPED),
    "jitter": AcquisitionEffect(jittered(5.0), ONE, Cause.SAMPLING_JITTER),
    "block of all lost": AcquisitionEffect(lost(), ONE, Cause.SAMPLES_LOST),
    "block of de lost": AcquisitionEffect(lost("de"), ONE, Cause.CHANNEL_SLIPPED),
    "block of zeros": AcquisitionEffect(zeroed("de"), ONE, Cause.CHANNEL_HELD),
    "block held": AcquisitionEffect(held("de"), ONE, Cause.CHANNEL_HELD),
    "charge amplifier of second order": AcquisitionEffect(
        filtered(highpass(8.0), "Vs"), names=frozenset({"charge_highpass"})
    ),
    "amplifier of second order": AcquisitionEffect(
        filtered(second_order(1800.0), *EVERY), names=frozenset({"amplifier_second_order"})
    ),
    "two close modes in de": AcquisitionEffect(two_modes("de")),
}


def spoilt(source: Path, place: Path, effect: AcquisitionEffect) -> Path:
    """A copy of a unit with the effect in its records."""
    shutil.copytree(source, place)
    for file in effect.files:
        (place / file).write_bytes(mat_bytes(dict(effect.spoil(columns(place / file)))))
    return place
