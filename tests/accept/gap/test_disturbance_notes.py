"""What the notes say of a record: hum, a motion beside the mains, a burst, a drive at its rail; and where they must
not."""

from dataclasses import replace

import numpy as np
import pytest

from checks.record import Record
from checks.signals import disturbance_notes
from tests.shared.strut_records import FS, SECONDS, drive, strut_record

T = np.arange(int(FS * SECONDS)) / FS


def sine(f_Hz: float, amplitude: float, phase: float = 0.0) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * f_Hz * T + phase)


def said(**added: np.ndarray) -> str:
    record = strut_record(1)
    return "; ".join(
        disturbance_notes(replace(record, channels={c: x + added.get(c, 0.0) for c, x in record.channels.items()}))
    )


def hum(f_Hz: float) -> dict[str, np.ndarray]:
    """What a converter picks up: each channel in its own size and phase."""
    return {"Vs": sine(f_Hz, 1e-3, 2.0), "de": sine(f_Hz, 8e-9), "da": sine(f_Hz, 5e-9, 1.2)}


def test_a_sound_record_has_no_note() -> None:
    assert said() == ""


@pytest.mark.parametrize("f_Hz", [50.02, 49.85, 60.1])
def test_hum_of_the_mains_stays_hum(f_Hz: float) -> None:
    assert said(**hum(f_Hz)).startswith("mains hum of ")


def test_a_motion_beside_the_mains_is_no_hum() -> None:
    """A pump's motor at 1490 turns a minute, twice a turn. Red before: "mains hum of 49.70 Hz"."""
    words = said(de=sine(49.7, 8e-9), da=sine(49.7, 8e-9), Vs=sine(49.7, 1e-3, 1.0))
    assert "a motion of 49.70 Hz" in words
    assert "hum" not in words


def test_a_motion_at_the_mains_may_be_either() -> None:
    assert said(de=sine(50.05, 8e-9), da=sine(50.05, 8e-9)).startswith("mains hum or a motion of 50.05 Hz")


def test_a_line_of_one_channel_is_neither() -> None:
    words = said(Vs=sine(49.7, 1e-3))
    assert words.startswith("a line of 49.70 Hz that the drive does not explain: Vs")
    assert "motion" not in said(**hum(49.7))


def short(f_Hz: float) -> np.ndarray:
    """30 ms of a sine at 3 s."""
    n, at = int(0.03 * FS), int(3.0 * FS)
    out = np.zeros(T.size)
    out[at : at + n] = np.hanning(n) * np.sin(2.0 * np.pi * f_Hz * T[:n])
    return out


@pytest.mark.parametrize("channel", ["Vs", "de", "da"])
def test_a_burst_is_said_with_its_channel_and_time(channel: str) -> None:
    """Red before: nothing was said."""
    size = {"Vs": 0.05, "de": 5e-7, "da": 5e-7}[channel]
    words = said(**{channel: size * short(300.0)})
    assert f"in {channel} alone at " in words
    assert float(words.split(" alone at ")[1].split(" s")[0]) == pytest.approx(3.0, abs=0.03)  # a slot
    assert "a burst of " in words


def test_a_hit_shows_in_all_channels() -> None:
    words = said(Vs=0.05 * short(300.0), de=5e-7 * short(300.0), da=5e-7 * short(300.0))
    assert "alone" not in words
    assert all(c in words for c in ("Vs", "de", "da"))


def changed(change: object) -> Record:
    record = strut_record(1)
    return replace(record, channels={c: x if c == "Va" else change(x) for c, x in record.channels.items()})  # type: ignore[operator]


@pytest.mark.parametrize(
    "change",
    [
        lambda x: x * (1.0 + 0.03 * np.linspace(0.0, 1.0, x.size)),
        lambda x: x * (1.0 + 0.05 * np.abs(x - x.mean()) / x.std()),
        lambda x: x + 0.01 * x.std() * np.random.default_rng(3).standard_normal(x.size),
    ],
    ids=["gain that drifts", "response that grows with the level", "more noise"],
)
def test_what_lasts_is_no_burst(change: object) -> None:
    assert disturbance_notes(changed(change)) == ()


@pytest.mark.parametrize("limit", [0.6, 0.9])
def test_a_drive_at_its_rail_is_said(limit: float) -> None:
    """Red before: only outputs were looked at."""
    words = "; ".join(disturbance_notes(strut_record(1, Va=np.clip(drive(1), -limit, limit))))
    assert "the drive Va is at its rail" in words
    assert f"hold {limit:.3g} V" in words or f"hold {-limit:.3g} V" in words


WHOLE = {
    "noise": drive(1),
    "noise in coarse steps": 0.02 * np.round(drive(1) / 0.02),
    "binary sequence": 0.3 * np.sign(drive(1)),
    "sine that repeats exactly": 0.5 * np.sin(2.0 * np.pi * 20.0 * T),
    "bursts of a sine, at rest between": np.where(T % 2.0 < 1.0, np.sin(2.0 * np.pi * 5.0 * T) ** 2, 0.0),
    "sweep": np.sin(2.0 * np.pi * (5.0 * T + 14.0 * T**2)),
}


@pytest.mark.parametrize("name", WHOLE)
def test_a_whole_drive_is_at_no_rail(name: str) -> None:
    assert "rail" not in " ".join(disturbance_notes(strut_record(1, Va=WHOLE[name])))
