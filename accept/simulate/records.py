"""Records of a modelled unit: frequency responses and slow sines, as the bench stores them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from accept.simulate.unit_request import UnitRequest
from checks.arrays import Array
from checks.model import Model, frequency_and_damping, loops_of, time_simulation
from checks.record import motion_of
from checks.signals import Notch, Rig

Columns = dict[str, Array | float]
Simulation = Callable[[Array], dict[str, Array]]  # of a drive Va (N,) to every channel (N,)

FS, SLOW_FS = 10_000.0, 1_000.0
MERGE_HZ = 350.0  # from the low record to the high one; both have drive there
LOW_HZ, HIGH_HZ = (1.0, 400.0), (290.0, 2100.0)
LOW_RMS_V, HIGH_RMS_V = 0.04, 0.3
SWEEP_HZ, SWEEP_V = (10.0, 400.0), 0.1
AMPLITUDES_V = {"apa": (0.05, 0.1, 0.2, 0.4, 1.0, 2.0, 4.0), "strut": (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)}  # by family
CYCLES = 3  # of each amplitude of the slow sines
AXIAL_HZ = (60.0, 140.0)


@dataclass(frozen=True, eq=False)
class DrivenUnit:
    """A unit on the bench, ready to be driven: its answers are found once for all records of a length."""

    request: UnitRequest
    model: Model
    known: dict[tuple[int, float], Simulation] = field(default_factory=dict)

    def play(self, name: str, Va: Array, fs: float) -> Columns:
        """Return the record of a drive Va (N,) about its mean: t, Va and the model's channels."""
        converters = self.request.converters
        given = converters.dac(Va)
        rng = self.request.rng(f"noise of {name}")
        bent = self.request.bent(given, AMPLITUDES_V[self.request.family][-1])
        truth = self.answer(given.size, fs)(bent)
        read = {c: converters.read(c, truth[c], rng) for c in self.model.channels}
        return {"t": np.arange(given.size) / fs, "Va": given, **read}

    def answer(self, samples: int, fs: float) -> Simulation:
        if (samples, fs) not in self.known:
            self.known[samples, fs] = time_simulation(
                self.model, samples, fs, self.request.hold, filters=self.request.filters
            )
        return self.known[samples, fs]


def noise_record(bench: DrivenUnit, name: str, high: bool, level: float = 1.0) -> Columns:
    """Return one realisation of low-passed or band-passed noise; level: of the drive, as a part of the usual one."""
    request = bench.request
    lo, hi = HIGH_HZ if high else LOW_HZ
    length, rms = (request.high_s, HIGH_RMS_V) if high else (request.low_s, LOW_RMS_V)
    seed = int(request.rng(f"drive of {name}").integers(2**31))
    return bench.play(name, _rig(FS).noise(lo, hi, length, level * rms, seed).proper, FS)


def sweep_record(bench: DrivenUnit, name: str) -> Columns:
    """Return a log sweep, notched at the axial resonance ([STB] 3.1.1)."""
    f_Hz = axial_Hz(bench.model)
    shape = Notch(f_Hz, 0.2 * f_Hz, 0.15)
    played = _rig(FS).sweep(*SWEEP_HZ, bench.request.low_s, SWEEP_V, shape=shape)
    return bench.play(name, played.proper, FS)


def slow_record(bench: DrivenUnit, name: str, own_width: float = 0.0) -> Columns:
    """Return a record of slow sines of growing amplitude about the middle of the stacks' range; own_width: relative
    width of the loop that the displacement alone shows at the largest of them (on Vs none is seen: [STB] 3.1.6)."""
    request = bench.request
    amplitudes = AMPLITUDES_V[request.family]
    played = _rig(SLOW_FS).sines(1.0, amplitudes, CYCLES)
    Va = played.proper
    columns = bench.play(name, Va, SLOW_FS)
    if own_width:
        given = np.asarray(columns["Va"])
        motion = motion_of(columns)
        moved = bench.answer(Va.size, SLOW_FS)(loops_of(own_width, amplitudes[-1])(given))[motion]
        columns[motion] = request.converters.read(motion, moved, request.rng(f"noise of {name}, {motion}"))
    columns["Va"] = np.asarray(columns["Va"]) + played.mean_V
    return {c: columns[c] for c in ("t", "Va", "Vs", motion_of(columns))}


def axial_Hz(model: Model) -> float:
    """Return the axial resonance [Hz]: the pole within its possible band that da shows most."""
    f, _ = frequency_and_damping(model.poles())
    near = f[(f > AXIAL_HZ[0]) & (f < AXIAL_HZ[1])]
    if near.size == 0:
        return 0.5 * sum(AXIAL_HZ)
    return float(near[np.argmax(np.abs(model.frf(near, channels=("da",))[:, 0]))])


def _rig(fs: float) -> Rig:
    """Return the rig; records start when the mean voltage is reached, without the ramp to it."""
    return Rig(fs=fs, ramp_s=0.0)
