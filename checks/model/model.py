"""The model of a unit on its bench: parameters by flat name in, responses of Vs, de and da to Va out.

model = build(load_model("strut-2dof"))
H = model.frf(f, {"joint.kz_N_per_um": 80.0}, channels=("de", "da"))       # (F, 2) complex, per volt of Va"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.model.dynamics.complex_modes import Modal, direct_frf, modal
from checks.model.dynamics.derivatives import (
    NO_MODES,
    Change,
    Modes,
    change_of_fastened,
    change_of_system,
    derivatives,
    modal_derivatives,
    square_slopes,
)
from checks.model.dynamics.real_modes import real_modal
from checks.model.dynamics.receptances import Receptances, receptances, receptances_between
from checks.model.free_apa_modes import ModalApa, mode_names
from checks.model.joint_prior import JointPrior
from checks.model.learned_bench import LearnedBench
from checks.model.measured_outputs import OutputGains, output_gains
from checks.model.parameters import (
    depends_on,
    derivative_step,
    in_range,
    is_mechanical,
    is_mode_factor,
    is_of_body,
    known,
    matters,
    rule,
    turns_ties,
)
from checks.model.parts import bench_of, encoder_of, joints_of, offset_of
from checks.model.structure.apa import ApaBody
from checks.model.structure.assemble import MOTIONS, FastenedParts, assemble, fasten, places_of
from checks.model.structure.attached import ELEMENT, PlaceReceptances, attached_of
from checks.model.structure.matrix_builder import System

MAX_POINTS = 1_000_000  # of a grid: a response at each takes a few hundred bytes
F_MAX = 5000.0  # [Hz] half of the bench's sampling rate; the reduction is made for 2 kHz, beyond 4 kHz peaks drift
FORCE_SENSOR = "apa.ke_N_per_um"
PRIOR_ONLY: Mapping[str, float] = {}

Values = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class CalibratedParameters:
    """The uncertain parameters: names (p,), prior values (p,) and standard deviations (p,) in the names' units."""

    names: tuple[str, ...]
    values: Array
    sds: Array


@dataclass(frozen=True, eq=False)
class Model:
    """A model ready to be evaluated. `values` holds every parameter by flat name; calls take changes.

    apa: parameters -> the APA's body; sds: prior standard deviations; joint: the joint prior of some of the uncertain
    parameters; tolerance: relative model error too small to matter; least: the tolerance that remains if the modes of
    the APA are uncertain and fitted; up_to_Hz: nothing is compared above; held: the payload is clamped as well. sha256:
    of the model's file and of the APA's matrices. damping: "full", or "modal" where each real mode has its own and
    modes exchange no energy through the dampers. learned: the unexplained factor of the bench on every unit."""

    name: str
    apa: Callable[[Values], ApaBody]
    values: Values
    sds: Values = field(default_factory=dict)
    tolerance: float = 0.0
    least: float = 0.0
    held: bool = False
    sha256: str = ""
    damping: str = "full"
    up_to_Hz: float = F_MAX
    joint: JointPrior | None = None
    learned: LearnedBench | None = None

    def __repr__(self) -> str:
        return f"Model({self.name}: {len(self.values)} parameters, {len(self.sds)} of them uncertain)"

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Return the channels: Vs, de, da; a strut without encoder has no de."""
        return self.system().channels

    @cached_property
    def size(self) -> int:
        """Return the number of coordinates of `system`."""
        return len(self.system().K)

    @property
    def scatters(self) -> bool:
        """Return whether the APA's modes are uncertain parameters, so that the model can be fitted to any strut."""
        return any(is_mode_factor(n) for n in self.sds)

    @property
    def calibrated(self) -> CalibratedParameters:
        names = tuple(self.sds)
        return CalibratedParameters(
            names, np.array([self.values[n] for n in names]), np.array([self.sds[n] for n in names])
        )

    def common_offset(self, name: str) -> float:
        """Return what the units of a learned batch have in common of a misalignment, or 0. A jig and the model's own
        error look the same, so it corrects no value and is part of every U ([JCGM100] F.2.4.5)."""
        return self.joint.values.get(name, 0.0) if self.joint and name.startswith("misalignment.") else 0.0

    def with_values(self, changes: Values) -> "Model":
        """Return the same model at other values. Raises ModelError for an unknown name or an impossible value."""
        return replace(self, values=self._at(changes))

    def drawn(self, rng: np.random.Generator, most: float) -> "Model":
        """Return the model with every uncertain parameter drawn from its prior, within so many standard deviations and
        its bounds."""
        c = self.calibrated
        away = np.clip(rng.standard_normal(len(c.names)), -most, most)
        values = c.values + away * c.sds
        return self.with_values(
            {
                n: max(float(v), 0.2 * float(nominal)) if rule(n).lo == 0.0 else float(v)
                for n, v, nominal in zip(c.names, values, c.values, strict=True)
            }
        )

    @property
    def elements(self) -> dict[str, float]:
        """Return the values of attached elements, by flat name."""
        return {n: v for n, v in self.values.items() if n.startswith(ELEMENT)}

    def with_elements(self, elements: Values) -> "Model":
        """Return the same with these values of attached elements (`checks.model.structure.attached`), and no others."""
        bare = {n: v for n, v in self.values.items() if not n.startswith(ELEMENT)}
        in_range(elements)
        return replace(self, values={**bare, **elements})

    def clamped(self) -> "Model":
        """Return the same with the payload held: its modes are the spurious ones ([STB] 2.4)."""
        return replace(self, held=True)

    def without_encoder(self) -> "Model":
        """Return the same strut before its encoder is fixed: no head, no ruler, no de ([STB] 5.1.1)."""
        bare = {n: v for n, v in self.values.items() if not n.startswith("encoder.")}
        return replace(self, values=bare, sds={n: s for n, s in self.sds.items() if n in bare})

    def system(self, changes: Values = PRIOR_ONLY) -> System:
        """Return the matrices from a force pair of 1 N to the sensor stack's elongation, the encoder's and the
        payload's z [m]."""
        return self._solved(self._at(changes))[0]

    def modal(self, changes: Values = PRIOR_ONLY) -> Modal:
        """Return the complex modes of `system`."""
        return self._solved(self._at(changes))[1]()

    def frf(self, f: ArrayLike, changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None) -> Complex:
        """Return the responses (F, C) [V/V, m/V] at f (F,) [Hz] to Va at the DAC, with amplifier, wires and converters.

        channels: default all that the model has, in the order Vs, de, da. Raises ModelError for a frequency outside
        0..5000 Hz, an unknown channel or parameter, an impossible value."""
        return self._frf(frequencies(f), self._at(changes), channels)

    def direct(self, f: ArrayLike, changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None) -> Complex:
        """Return the same as `frf` by solving the matrices anew at every frequency: slow, to test against."""
        f = frequencies(f)
        system = self.system(changes)
        wanted = system.channels if channels is None else tuple(channels)
        seen = self._measure(f, self._at(changes), system.channels, wanted)
        return seen(direct_frf(system, f), modal(system).static())

    def jacobian(
        self, f: ArrayLike, names: Iterable[str], changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None
    ) -> Complex:
        """Return the derivatives (P, F, C) of `frf` by each named parameter, per unit of its name: closed forms for the
        matrices (`checks.model.dynamics.derivatives`), central differences for the measurement chain. In memory the
        channels come before the frequencies."""
        f, v, names = frequencies(f), self._at(changes), tuple(names)
        known(names, v)
        form = _solver(self, f, *self._solved(v))
        wanted = form.channels if channels is None else tuple(channels)
        inside = [i for i, n in enumerate(names) if self._smooth(n)]
        moved = self._motion_derivatives(f, [names[i] for i in inside], changes)
        converted = self._measure(f, v, form.channels, wanted).in_proportion(moved[:, 1:], moved[:, 0].real)
        if len(inside) == len(names) and not any(_changes_measurement(n, v) for n in names):
            return converted
        found = np.zeros((len(names), len(wanted), f.size), dtype=complex).swapaxes(1, 2)
        found[inside] = converted
        smooth = {names[i] for i in inside}
        H, static = form.frf(f), form.static()
        for i, name in enumerate(names):
            if name in smooth and not _changes_measurement(name, v):
                continue
            known_motion = name in smooth or not is_mechanical(name)
            above, below = (
                self._measure(f, end, form.channels, wanted)(H, static) if known_motion else self._frf(f, end, wanted)
                for end in _ends(v, name)
            )
            found[i] += (above - below) / (2.0 * derivative_step(name, v[name]))
        return found

    def place_receptances(
        self, f: ArrayLike, changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None
    ) -> PlaceReceptances:
        """Return the receptances between every named place, drive and channels at f (F,) [Hz]."""
        f, v = frequencies(f), self._at(changes)
        system = self._solved(v)[0]
        if system.motions is None:
            raise ModelError(f"{self.name}: its system reads no motions")
        wanted = system.channels if channels is None else tuple(channels)
        rows = np.vstack([system.motions[:MOTIONS], system.outputs, system.force])
        G = receptances_between(system, rows, 2.0 * np.pi * f, self.damping)
        seen = self._measure(f, v, system.channels, wanted)
        y = seen.in_proportion(np.moveaxis(G[:MOTIONS, MOTIONS:-1], -1, 1), np.zeros((MOTIONS, len(system.channels))))
        places = places_of(joints_of(v), encoder_of(v), offset_of(v))
        return PlaceReceptances(places, G[:MOTIONS, :MOTIONS], G[:MOTIONS, -1], y)

    def square_slopes(self, names: Iterable[str], changes: Values = PRIOR_ONLY) -> tuple[Array, Array]:
        """Return the squared frequencies (n,) [rad2/s2] of the undamped modes, rising, and (P, n) their derivatives per
        unit of named parameters of the matrices; zero for one that turns the coordinates. Raises ModelError."""
        names = tuple(names)
        smooth = [n for n in names if self._smooth(n)]
        system, changed, modes, order = self._matrix_changes(smooth, changes)
        w2, slopes = square_slopes(system, changed, modes)
        found = dict(zip(order, slopes, strict=True))
        return w2, np.array([found.get(n, np.zeros_like(w2)) for n in names]).reshape(len(names), w2.size)

    def poles(self, changes: Values = PRIOR_ONLY) -> Complex:
        """Return the poles [rad/s] of the mechanics, Im >= 0, by magnitude; `frequency_and_damping` reads them."""
        return self.modal(changes).poles()

    def zeros(self, channel: str, changes: Values = PRIOR_ONLY) -> Complex:
        """Return the zeros [rad/s] of one channel's mechanics, Im >= 0, by rising magnitude."""
        return self.modal(changes).zeros(channel)

    def _at(self, changes: Values) -> dict[str, float]:
        known(changes, self.values)
        in_range(changes)
        return {**self.values, **changes}

    def _frf(self, f: Array, v: Values, channels: Iterable[str] | None) -> Complex:
        """Return the response at values that are not checked: a derivative may look just past a bound."""
        form = _solver(self, f, *self._solved(v))
        wanted = form.channels if channels is None else tuple(channels)
        return self._measure(f, v, form.channels, wanted)(form.frf(f), form.static())

    def _measure(self, f: Array, v: Values, have: tuple[str, ...], wanted: tuple[str, ...]) -> OutputGains:
        """Return the channels measured from a motion of the channels `have`, through a learned bench if the model has
        one. Raises ModelError for a channel that the model does not have."""
        if unknown := [c for c in wanted if c not in have]:
            raise ModelError(f"{self.name}: no channel '{unknown[0]}' (it has {', '.join(have)})")
        return output_gains(f, v, have, wanted, self.learned)

    def _solved(self, v: Values) -> "tuple[System, Callable[[], Modal]]":
        return _solved(self, self._mechanical(v))

    @cached_property
    def mechanical(self) -> tuple[str, ...]:
        """Return the names of the parameters that the matrices depend on, in the order of `values`."""
        return tuple(n for n in self.values if is_mechanical(n))

    @cached_property
    def _mechanical(self) -> Callable[[Values], tuple[float, ...]]:
        return itemgetter(*self.mechanical)

    def _smooth(self, name: str) -> bool:
        """Return whether the matrices change in fixed coordinates. Rigid directions are eliminated; if they turn, the
        coordinates do too."""
        return is_mechanical(name) and not (self._has_ties and turns_ties(name))

    @cached_property
    def _has_ties(self) -> bool:
        joints = joints_of(self.values)
        return self.held or joints is None or any(bool(np.isinf(j.k).any()) for j in joints)

    def _motion_derivatives(self, f: Array, names: Sequence[str], changes: Values) -> Complex:
        """Return the changes (P, 1 + F, c) of the motion per newton, first at rest, then at f."""
        system, changed, modes, order = self._matrix_changes(names, changes)
        s = 2j * np.pi * np.concatenate([[0.0], f])
        place = {n: i for i, n in enumerate(order)}
        kept = [place[n] for n in names]
        return (modal_derivatives if self.damping == "modal" else derivatives)(system, changed, s, modes, kept)

    def _matrix_changes(
        self, names: Sequence[str], changes: Values
    ) -> tuple[System, list[Change], Modes, tuple[str, ...]]:
        """Return the system, its changes by parameters and by factors on the APA's modes, and their names."""
        system = self.system(changes)
        factors = any(is_mode_factor(n) for n in names)
        others = [n for n in names if not is_mode_factor(n)]
        mattering = matters(changes)
        changed = [_change(self, n, depends_on(n, mattering, self._has_ties)) for n in others]
        modes, of_modes = self._modes(system, changes) if factors else (NO_MODES, ())
        return system, changed, modes, (*others, *of_modes)

    def _modes(self, system: System, changes: Values) -> tuple[Modes, tuple[str, ...]]:
        """Return the free modes of the APA in a system, and the names of the factors on their stiffness and damping."""
        if not isinstance(self.apa, ModalApa):
            raise ModelError(f"model {self.name}: its APA is not given by its modes")
        ratio = {**self.values, **changes}["apa.damping_ratio"]
        stiffness, damping = mode_names(self.apa.modes)
        return self.apa.changes(ratio, system), (*stiffness, *damping)


@lru_cache(maxsize=64)
def _solved(model: Model, mechanical: tuple[float, ...]) -> tuple[System, Callable[[], Modal]]:
    """Return the matrices at these mechanical values and the solver of their modes. Cached: a search repeats values."""
    system = _assemble_at(model, dict(zip(model.mechanical, mechanical, strict=True)))
    return system, lru_cache(maxsize=1)(lambda: real_modal(system) if model.damping == "modal" else modal(system))


def _solver(model: Model, f: Array, system: System, solved: Callable[[], Modal]) -> Modal | Receptances:
    """Return the solver at f (F,) [Hz]: by parts for damping of any form if they are known, else by modes."""
    return (receptances(system, 2.0 * np.pi * f) if model.damping == "full" else None) or solved()


@lru_cache(maxsize=512)
def _change(model: Model, name: str, others: tuple[tuple[str, float], ...]) -> Change:
    """Return the change of the matrices by a parameter; others: values that differ from the model's own."""
    values = {**model.values, **dict(others)}
    above, below = _ends(values, name)
    h = derivative_step(name, values[name])
    if is_of_body(name):
        return change_of_system(_assemble_at(model, above), _assemble_at(model, below), h)
    apa = model.apa(values)
    return change_of_fastened(_fasten_at(model, apa, above), _fasten_at(model, apa, below), h, model.size)


def _assemble_at(model: Model, v: Values) -> System:
    apa = model.apa(v)
    return assemble(apa, v.get("apa.damping_ratio", 0.0), _fasten_at(model, apa, v))


def _fasten_at(model: Model, apa: ApaBody, v: Values) -> FastenedParts:
    stiffening = v["apa.sensor_stiffening"] * apa.k_sensor, v["apa.actuator_stiffening"] * apa.k_actuator
    return fasten(joints_of(v), encoder_of(v), bench_of(v, model.held), offset_of(v), stiffening, attached_of(v))


def _ends(values: Values, name: str) -> tuple[dict[str, float], dict[str, float]]:
    """Return the values one step of a parameter above and below."""
    h = derivative_step(name, values[name])
    above, below = ({**values, name: values[name] + d} for d in (h, -h))
    return above, below


def _changes_measurement(name: str, values: Values) -> bool:
    """Return whether a mechanical parameter also changes the measurement (the sensor of a 2-DoF APA reads a spring's
    force)."""
    return name == FORCE_SENSOR and "constants.gs_V_per_N" in values


def frequencies(f: ArrayLike) -> Array:
    """Return the frequencies (F,) [Hz] as an array. Raises ModelError naming a value that is not within 0..5000 Hz."""
    f = np.asarray(f, dtype=float)
    if f.ndim != 1 or f.size == 0:
        raise ModelError(f"frequencies have shape {f.shape}; expected one row of at least one")
    bad = ~((f >= 0.0) & (f <= F_MAX))
    if bad.any():
        raise ModelError(f"frequency {f[bad][0]:g} Hz is outside the model's 0..{F_MAX:g} Hz")
    return f


def frequency_grid(f_lo: float, f_hi: float, points: int) -> Array:
    """Return (points,) frequencies [Hz] spread evenly over log f. Raises ModelError if there is no such grid."""
    if not 0.0 < f_lo < f_hi < np.inf or not 2 <= points <= MAX_POINTS:
        raise ModelError(
            f"{points} points from {f_lo:g} to {f_hi:g} Hz: expected 2 to {MAX_POINTS} of them over a rising range"
        )
    return frequencies(np.geomspace(f_lo, f_hi, points))


def frequency_and_damping(roots: NDArray[np.complex128]) -> tuple[Array, Array]:
    """Return the frequencies [Hz] and damping ratios of poles or zeros [rad/s]; below zero: right half plane."""
    size = np.abs(roots)
    return size / (2.0 * math.pi), -roots.real / size
