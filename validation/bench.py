"""The bench of the blind tests: what is played, what the strut does in time, what the converters make of it.

The drive is what the 16-bit converter gives out, joined up without images (its hold taken for compensated, as in the
recorded units, which show no half sample of lag). It is interpolated to twice the rate, bent by whatever is not linear,
and goes through all modes in exact steps (`Rational.run`). Every record starts from rest, or after a second of drive.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal
from scipy.io import savemat

from validation.rational import Rational, in_channels, resonance, step
from validation.strut import Strut, plant

Array = NDArray[np.float64]
Bend = Callable[[Array], Array]
Drive = Callable[[Array, float], Array]  # drive, step [s] -> drive
Curve = Callable[[Array], NDArray[np.complex128]]  # f [Hz] >= 0 -> factor
Law = Callable[[], Callable[[float], float]]  # makes a fresh one: motion of the payload at every step -> force on it

FS = 10_000.0
SECONDS = 20.0
TWICE = 2
CONVERTER_V = 10.0
FULL_V = 9.5
SOFTER = 0.7
LSB_V = 2 * CONVERTER_V / 2**16
ENCODER_M = 2.5e-9
INTERFEROMETER_M = 1e-10
SLOW_FS = 1000.0
SLOW_TIMES = 10  # steps of the spring
SLOW_AMPLITUDES_V = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
SLOW_CYCLES = 3
RECORDS = 4  # of noise, before the slow one
CONSTANT = 64  # steps for which a drifting pole stays where it is: 3 ms
SPRING_BELOW_HZ = 130.0  # the axial mode alone

UNIT_TOML = """serial = "{serial}"
kind = "strut"

[parts]
apa = "APA-{serial}"
joint_bottom = "FJ-a"
joint_top = "FJ-b"
encoder = "ENC-1"

[frf]
low = "frf_noise.mat"
high = "frf_noise_hf.mat"
merge_Hz = 350.0
low_repeat = "frf_noise_2.mat"
high_repeat = "frf_noise_hf_2.mat"

[hysteresis]
record = "hysteresis.mat"
"""


# key of unit.toml, end of the file's name; of a second realisation the same
BANDS = (("low", "", "", ""), ("low", "", "_repeat", "_2"), ("high", "_hf", "", ""), ("high", "_hf", "_repeat", "_2"))


@dataclass(frozen=True, eq=False)
class World:
    """A strut and everything between it and the files. modes: (f_Hz, ratio, damping_ratio) added to de and da; filters:
    (channels, filter) multiplied in, in order; crosstalk: of the amplifier's output per volt of Va into Vs;
    drive_filters: on every output; tau: delay of every output, lags: of single ones [s]; bends: what is not linear in
    the drive; cubic: spring on the payload [N/m3]; exchanged: two channels each in the place of the other. added: paths
    of three channels beside the strut's own, before the filters; curves: (channels, factor by frequency) multiplied in,
    which no sum of poles gives; drives: what the drive's path does that depends on its past; law: force on the payload
    by its motion; drifting: modes of three channels beside the strut's own whose frequency moves along a record;
    changes: what becomes of the outputs until they are sampled."""

    strut: Strut
    modes: tuple[tuple[float, float, float], ...] = ()
    filters: tuple[tuple[tuple[int, ...], Rational], ...] = ()
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    crosstalk: float = 0.0
    drive_filters: tuple[Rational, ...] = ()
    tau: float = 0.0
    lags: tuple[float, float, float] = (0.0, 0.0, 0.0)
    bends: tuple[Bend, ...] = ()
    cubic: float = 0.0
    exchanged: tuple[str, str] | None = None
    added: tuple[Rational, ...] = ()
    curves: tuple[tuple[tuple[int, ...], Curve], ...] = ()
    drives: tuple[Drive, ...] = ()
    law: Law | None = None
    drifting: tuple["Drifting", ...] = ()
    changes: tuple["Change", ...] = ()


@dataclass(frozen=True)
class Drifting:
    """A mode whose frequency moves in proportion to time, by `relative` from the beginning of a record to its end, with
    f_Hz in the middle. gains (3,): of de, da, Vs far below the mode, per volt of Va."""

    f_Hz: float
    damping_ratio: float
    gains: tuple[float, float, float]
    relative: float


@dataclass(frozen=True, eq=False)
class Sampling:
    """What a change of the outputs may depend on. Va (N,); index: number of the record of the unit; rng: of this record
    and nothing else."""

    Va: Array
    fs: float
    index: int
    rng: np.random.Generator


Change = Callable[[Array, Sampling], Array]  # outputs (3, N) -> outputs


@dataclass(frozen=True)
class Setting:
    """The state of the bench on a day: excitation, noise, mains, drift. rms of noise at the full rate; interpolation_m:
    amplitude of the error that the encoder makes within each of its periods."""

    low_rms_V: float = 0.04
    low_Hz: float = 300.0
    high_rms_V: float = 0.3
    high_from_Hz: float = 300.0
    high_to_Hz: float = 2000.0
    preroll_s: float = 0.0
    encoder_m: float = 2e-9
    interferometer_m: float = 2e-9
    sensor_V: float = 1.08e-3
    floor_m: float = 0.0  # slow movement of the floor: in de and da alike
    coloured_V: float = 0.0
    coloured_Hz: float = 20.0
    drift_m: float = 0.0
    drift_V: float = 0.0
    mains_m: float = 0.0
    mains_V: float = 0.0
    mains_lines: tuple[tuple[float, float], ...] = ((50.03, 1.0), (150.09, 0.3))  # [Hz], share of the amplitude
    interpolation_m: float = 0.0
    period_m: float = 4e-6
    seconds: float = SECONDS


def draw_rough(rng: np.random.Generator, calm: Setting) -> Setting:
    """Return the same day on a rough bench: five times the noise, mains hum with its harmonics as ground loops make it,
    and an encoder whose two signals are not quite equal."""
    hum = rng.uniform(49.95, 50.05)
    return replace(
        calm,
        **{name: 5 * getattr(calm, name) for name in ("encoder_m", "interferometer_m", "sensor_V")},
        **{name: 5 * getattr(calm, name) for name in ("floor_m", "coloured_V", "drift_m", "drift_V")},
        mains_m=rng.uniform(2e-9, 10e-9),
        mains_V=rng.uniform(2e-3, 10e-3),
        mains_lines=tuple((k * hum, share) for k, share in ((1, 1.0), (2, 0.2), (3, 0.5), (5, 0.3), (7, 0.1))),
        interpolation_m=rng.uniform(3e-9, 12e-9),
        period_m=float(np.exp(rng.uniform(np.log(0.5e-6), np.log(4e-6)))),
    )


def draw_setting(rng: np.random.Generator) -> Setting:
    """Return a setting near those of the recorded units, and a little worse."""
    return Setting(
        low_rms_V=rng.uniform(0.033, 0.045),
        low_Hz=rng.uniform(280, 330),
        high_rms_V=rng.uniform(0.25, 0.33),
        high_from_Hz=rng.uniform(270, 310),
        high_to_Hz=rng.uniform(1900, 2200),
        preroll_s=float(rng.integers(2)),
        encoder_m=rng.uniform(1.5e-9, 2.5e-9),
        interferometer_m=rng.uniform(1.5e-9, 2.5e-9),
        sensor_V=rng.uniform(0.8e-3, 1.4e-3),
        floor_m=rng.uniform(0.3e-9, 2e-9),
        coloured_V=rng.uniform(0.1e-3, 0.8e-3),
        coloured_Hz=rng.uniform(5, 50),
        drift_m=rng.uniform(-50e-9, 50e-9),
        drift_V=rng.uniform(-3e-3, 3e-3),
        mains_m=rng.uniform(0.05e-9, 0.6e-9),
        mains_V=rng.uniform(0.05e-3, 0.6e-3),
    )


def linear(world: World) -> Rational:
    """Return the linear path from Va to de, da, Vs, without delays."""
    path = plant(world.strut)
    still = path.at(np.zeros(1))[1, 0].real
    for f_Hz, ratio, zeta in world.modes:
        path = path.plus(_on_both(resonance(f_Hz, zeta, ratio * still)))
    for beside in world.added:
        path = path.plus(beside)
    for channels, each in world.filters:
        path = path.times(each, channels)
    path = path.scaled(np.array(world.gains))
    path = Rational(path.poles, path.residues, path.direct + np.array([0.0, 0.0, world.crosstalk]))
    for each in world.drive_filters:
        path = path.times(each)
    return path


def _on_both(mode: Rational) -> Rational:
    share = np.array([[1.0], [1.0], [0.0]])
    return Rational(mode.poles, share * mode.residues, np.zeros(3))


def frf(world: World, f: Array) -> NDArray[np.complex128]:
    """Return the linear response (3, F) of a world at f [Hz], delays and all; a mode that drifts stands where it is in
    the middle of a record."""
    still = [in_channels(resonance(d.f_Hz, d.damping_ratio), d.gains) for d in world.drifting]
    late = world.tau + np.array(world.lags)
    H = linear(replace(world, added=(*world.added, *still))).frf(f) * np.exp(-2j * np.pi * f * late[:, None])
    for channels, curve in world.curves:
        H[list(channels)] *= curve(f)
    return H


@dataclass(frozen=True, eq=False)
class Playing:
    """A world ready to be driven: its poles are computed once for all records."""

    world: World
    path: Rational = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", linear(self.world))

    def drive(self, Va: Array, fs: float, every: int) -> Array:
        """Return de, da, Vs (3, N) without noise for a drive Va (N,) at fs; every: factor of the interpolation."""
        u = interpolate(Va, fs, every, self.world.tau)
        for bend in self.world.bends:
            u = bend(u)
        for each in self.world.drives:
            u = each(u, 1 / (fs * every))
        y = self.path.run(u, 1 / (fs * every), every)
        for mode in self.world.drifting:
            y = y + _drifted(mode, u, 1 / (fs * every), every)
        if self.world.cubic or self.world.law:
            y = y + _sprung(self.world, u, 1 / (fs * every), every)
        for channels, curve in self.world.curves:
            y[list(channels)] = _shaped(y[list(channels)], fs, curve)
        return _late(y, fs, self.world.lags) if any(self.world.lags) else y


def interpolate(u: Array, fs: float, times: int, delay: float = 0.0) -> Array:
    """Return the interpolated drive (N times,), without images, late by `delay`."""
    size = fft.next_fast_len(u.size + 4096)
    f = fft.rfftfreq(size, 1 / fs)
    spectrum = fft.rfft(u, size) * np.exp(-2j * np.pi * f * delay)
    if times == 1:
        return fft.irfft(spectrum, size)[: u.size]
    wide = np.zeros(size * times // 2 + 1, dtype=complex)
    wide[: spectrum.size] = spectrum
    return times * fft.irfft(wide, size * times)[: u.size * times]


def _late(y: Array, fs: float, lags: tuple[float, float, float]) -> Array:
    size = fft.next_fast_len(y.shape[1] + 4096)
    turn = np.exp(-2j * np.pi * fft.rfftfreq(size, 1 / fs) * np.array(lags)[:, None])
    return fft.irfft(fft.rfft(y, size) * turn, size)[:, : y.shape[1]]


def _shaped(y: Array, fs: float, curve: Curve) -> Array:
    size = fft.next_fast_len(y.shape[1] + 4096)
    return fft.irfft(fft.rfft(y, size) * curve(fft.rfftfreq(size, 1 / fs)), size)[:, : y.shape[1]]


def _drifted(mode: Drifting, u: Array, dt: float, every: int) -> Array:
    """Return the response (3, N) of a mode that drifts: exact steps, each with the pole of its moment."""
    w = 2 * np.pi * mode.f_Hz * (1 + mode.relative * np.linspace(-0.5, 0.5, u.size))
    damped = w * np.sqrt(1 - mode.damping_ratio**2)
    poles = -mode.damping_ratio * w + 1j * damped
    new, old, decay = (np.array(each) for each in zip(*(step(p, dt) for p in poles[::CONSTANT]), strict=True))
    weights = [np.repeat(each, CONSTANT)[: u.size] for each in (new, old, decay)]
    forced = weights[0] * u + weights[1] * np.concatenate([[0.0], u[:-1]])
    x, state = np.empty(u.size, complex), 0j
    for k, (push, shrink) in enumerate(zip(forced.tolist(), weights[2].tolist(), strict=True)):
        state = shrink * state + push
        x[k] = state
    shown = 2 * np.real(w**2 / (2j * damped) * x)[::every]
    return np.array(mode.gains)[:, None] * shown


def _sprung(world: World, u: Array, dt: float, every: int) -> Array:
    """Return the response (3, N) that a force on the payload adds, of a spring or another law: the payload's own modes
    step by step, then all for that force."""
    push, alone = plant(world.strut, column=1), plant(world.strut)
    to_payload, free = _payload(push), _payload(alone).run(u, dt)[0]
    law = world.law() if world.law else lambda x: -world.cubic * x**3
    force = np.array(_force_on_payload(free.tolist(), to_payload, law, dt))
    return push.run(force, dt, every)


def _payload(path: Rational) -> Rational:
    """Return the payload's motion by the axial mode and the statics of all others."""
    slow = np.abs(path.poles) < 2 * np.pi * SPRING_BELOW_HZ
    mode = Rational(path.poles[slow], path.residues[1:2, slow], np.zeros(1))
    still = path.at(np.zeros(1))[1, 0].real - mode.at(np.zeros(1))[0, 0].real
    return replace(mode, direct=np.array([still]))


def _force_on_payload(free: list[float], path: Rational, law: Callable[[float], float], dt: float) -> list[float]:
    """Return the force at every step; each step extrapolates the last two forces."""
    (pole,), (residue,), still = path.poles, path.residues[0], float(path.direct[0])
    new, old, decay = step(pole, dt)
    state, before, force, out = 0j, 0.0, 0.0, []
    for x in free:
        ahead = 2 * force - before
        state = decay * state + new * ahead + old * force
        moved = x + 2 * (residue * state).real + still * ahead
        before, force = force, law(moved)
        out.append(force)
    return out


def excitation(rng: np.random.Generator, s: Setting, high: bool) -> Array:
    """Return the noise drive (N,) of the low or the high record, with its preroll, before the converter."""
    n = int((s.seconds + s.preroll_s) * FS)
    white = rng.standard_normal(n)
    if high:
        shape = signal.butter(4, [s.high_from_Hz, s.high_to_Hz], "bandpass", fs=FS, output="sos")
    else:
        shape = signal.butter(4, s.low_Hz, fs=FS, output="sos")
    u = signal.sosfilt(shape, white)
    return u * ((s.high_rms_V if high else s.low_rms_V) / np.std(u))


def quantise(x: Array, step: float, limit: float = np.inf) -> Array:
    return np.clip(np.round(x / step) * step, -limit, limit - step if np.isfinite(limit) else np.inf)


def _noise(rng: np.random.Generator, s: Setting, n: int, fs: float) -> Array:
    """Return all noise (3, N) that is added to de, da, Vs."""
    t = np.arange(n) / fs
    white = rng.standard_normal((3, n)) * [[s.encoder_m], [s.interferometer_m], [s.sensor_V]]
    decay = np.exp(-2 * np.pi * s.coloured_Hz / fs)
    slow = signal.lfilter([np.sqrt(1 - decay**2)], [1.0, -decay], rng.standard_normal((2, n)))
    mains = sum(a * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi, (3, 1))) for f, a in s.mains_lines)
    wander = np.cumsum(rng.standard_normal((2, n)), axis=1) / n
    drift = t / t[-1] + 0.3 * np.sqrt(n) * wander
    metres = s.floor_m * slow[0] + s.drift_m * drift[0]
    volts = s.coloured_V * slow[1] + s.drift_V * drift[1]
    lines = mains * [[s.mains_m], [s.mains_m], [s.mains_V]]
    return white + lines + np.stack([metres, metres, volts])


def record(playing: Playing, s: Setting, rng: np.random.Generator, high: bool, index: int = 0) -> dict[str, Array]:
    """Return t, Va, Vs, de, da (N,) of one noise record. index: its number in the unit."""
    Va, y = _in_range(playing, excitation(rng, s, high))
    start = int(s.preroll_s * FS)
    y = _changed(playing.world, y[:, start:], Va[start:], FS, index, rng)
    y = y + _noise(rng, s, y.shape[1], FS)
    columns = {"t": np.arange(y.shape[1]) / FS, "Va": Va[start:], **_read(y, s)}
    return _exchanged(columns, playing.world.exchanged)


def _changed(world: World, y: Array, Va: Array, fs: float, index: int, rng: np.random.Generator) -> Array:
    """Return the outputs after every change, which draws from a generator of its own: noise stays what it is."""
    for change in world.changes:
        y = change(y, Sampling(Va, fs, index, rng.spawn(1)[0]))
    return y


def _exchanged(columns: dict[str, Array], pair: tuple[str, str] | None) -> dict[str, Array]:
    if pair is None:
        return columns
    first, second = pair
    return {**columns, first: columns[second], second: columns[first]}


def _in_range(playing: Playing, u: Array) -> tuple[Array, Array]:
    """Return Va and the response to it, with Va reduced, as an operator would do, until the converter of Vs takes
    it."""
    while True:
        Va = quantise(u, LSB_V, CONVERTER_V)
        y = playing.drive(Va, FS, TWICE)
        if np.max(np.abs(y[2])) < FULL_V:
            return Va, y
        u = u * SOFTER


def _read(y: Array, s: Setting) -> dict[str, Array]:
    de, da, Vs = y
    de = de + s.interpolation_m * np.sin(2 * np.pi * de / s.period_m)
    converted = quantise(Vs, LSB_V, CONVERTER_V), quantise(de, ENCODER_M), quantise(da, INTERFEROMETER_M)
    return dict(zip(("Vs", "de", "da"), converted, strict=True))


def slow_record(playing: Playing, s: Setting, rng: np.random.Generator) -> dict[str, Array]:
    """Return t, Va, de of slow sines of growing amplitude, 1 Hz."""
    cycle = np.sin(2 * np.pi * np.arange(int(SLOW_FS)) / SLOW_FS)
    Va = np.concatenate([a * np.tile(cycle, SLOW_CYCLES) for a in SLOW_AMPLITUDES_V])
    fine = playing.world.cubic or playing.world.law
    y = _changed(playing.world, playing.drive(Va, SLOW_FS, SLOW_TIMES if fine else 1), Va, SLOW_FS, RECORDS, rng)
    y = y + _noise(rng, s, Va.size, SLOW_FS)
    return {"t": np.arange(Va.size) / SLOW_FS, "Va": Va, "de": _read(y, s)["de"]}


def write_unit(folder: Path, serial: str, world: World, s: Setting, seed: int) -> Path:
    """Write a unit folder as a bench leaves it: two realisations of both bands, slow sines, `unit.toml`. The truth is
    not in it."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    playing = Playing(world)
    _write_responses(folder, playing, s, rng, "")
    _save(folder / "hysteresis.mat", slow_record(playing, s, rng))
    (folder / "unit.toml").write_text(UNIT_TOML.format(serial=serial))
    return folder


def add_experiment(folder: Path, world: World, s: Setting, seed: int, kind: str, value: str) -> None:
    """Add the responses of a world to a unit folder, as those under an experiment of a kind; value: its line of
    `unit.toml`, such as "mass_kg = 0.5", or ""."""
    _write_responses(folder, Playing(world), s, np.random.default_rng(seed), f"_{kind}")
    names = {f"{band}{again}": f"frf_noise{hf}_{kind}{repeat}.mat" for band, hf, again, repeat in BANDS}
    entry = "".join(f'{key} = "{name}"\n' for key, name in names.items())
    with (folder / "unit.toml").open("a") as unit:
        unit.write(f'\n[[experiments]]\nkind = "{kind}"\n{value}\n{entry}')


def _write_responses(folder: Path, playing: Playing, s: Setting, rng: np.random.Generator, marked: str) -> None:
    for k, (_, hf, _, repeat) in enumerate(BANDS):
        _save(folder / f"frf_noise{hf}{marked}{repeat}.mat", record(playing, s, rng, bool(hf), index=k))


def _save(path: Path, columns: dict[str, Array]) -> None:
    savemat(path, {name: column.reshape(-1, 1) for name, column in columns.items()})
