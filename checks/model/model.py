"""The model of a unit on its bench: parameters by flat name in, responses of Vs, de and da to Va out.

model = build(load_model("strut-2dof"))
H = model.frf(f, {"joint.kz_N_per_um": 80.0}, channels=("de", "da"))       # (F, 2) complex, per volt of Va
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from checks.model.apa import ApaBody
from checks.model.assemble import assemble
from checks.model.bench import suspension
from checks.model.builder import System
from checks.model.encoder import bracket
from checks.model.modal import Complex, Modal, direct_frf, modal
from checks.model.parameters import derivative_step, in_range, is_mechanical, known
from checks.model.parts import bench_of, electrical_of, encoder_of, joints_of, offset_of
from checks.model.real_modes import real_modal
from checks.model.superelement import Array, ModelError

CHANNELS = ("Vs", "de", "da")
F_MAX = 5000.0  # [Hz] half of the bench's sampling rate; the reduction is made for 2 kHz, beyond 4 kHz peaks drift
PRIOR_ONLY: Mapping[str, float] = {}

Values = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The uncertain parameters: names (p,), prior values (p,) and standard deviations (p,) in the names' units."""

    names: tuple[str, ...]
    values: Array
    sds: Array


@dataclass(frozen=True, eq=False)
class Model:
    """A model ready to be evaluated. `values` holds every parameter by flat name; calls take changes of them.

    apa: parameters -> the APA's body; sds: prior standard deviations; tolerance: relative model error too small to
    matter; held: the payload is clamped as well. sha256: of the model's file and of the APA's matrices. damping:
    "full", or "modal" where each real mode has its own and modes exchange no energy through the dampers.
    """

    name: str
    apa: Callable[[Values], ApaBody]
    values: Values
    sds: Values = field(default_factory=dict)
    tolerance: float = 0.0
    held: bool = False
    sha256: str = ""
    damping: str = "full"

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Vs, de, da; a strut without encoder has no de."""
        return self.system().channels

    @property
    def calibrated(self) -> Calibrated:
        names = tuple(self.sds)
        return Calibrated(names, np.array([self.values[n] for n in names]), np.array([self.sds[n] for n in names]))

    def with_values(self, changes: Values) -> "Model":
        """The same model at other values. Raises ModelError for an unknown name or an impossible value."""
        return replace(self, values=self._at(changes))

    def clamped(self) -> "Model":
        """The same with the payload held: its modes are the spurious ones (seed, section 2.4)."""
        return replace(self, held=True)

    def without_encoder(self) -> "Model":
        """The same strut before the encoder is fixed: no head, no ruler, no de (seed, section 5.1.1)."""
        bare = {n: v for n, v in self.values.items() if not n.startswith("encoder.")}
        return replace(self, values=bare, sds={n: s for n, s in self.sds.items() if n in bare})

    def system(self, changes: Values = PRIOR_ONLY) -> System:
        """Matrices from a force pair of 1 N to the sensor stack's elongation, the encoder's and the payload's z [m]."""
        v = self._at(changes)
        return assemble(
            self.apa(v),
            v.get("apa.damping_ratio", 0.0),
            joints_of(v),
            encoder_of(v),
            bench_of(v, self.held),
            offset_of(v),
            (v["apa.sensor_stiffening"], v["apa.actuator_stiffening"]),
        )

    def modal(self, changes: Values = PRIOR_ONLY) -> Modal:
        """Complex modes of `system`."""
        system = self.system(changes)
        return real_modal(system) if self.damping == "modal" else modal(system)

    def frf(self, f: ArrayLike, changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None) -> Complex:
        """(F, C) responses [V/V, m/V] at f (F,) [Hz] to Va at the DAC, with amplifier, wires and converters.

        channels: default all that the model has, in the order Vs, de, da. Raises ModelError for a frequency outside
        0..5000 Hz, an unknown channel or parameter, an impossible value."""
        f = frequencies(f)
        values, form = self._at(changes), self.modal(changes)
        return self._measured(f, values, form, form.frf(f), channels)

    def direct(self, f: ArrayLike, changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None) -> Complex:
        """The same as `frf` by solving the matrices anew at every frequency: slow, to test against."""
        f = frequencies(f)
        values, system = self._at(changes), self.system(changes)
        return self._measured(f, values, modal(system), direct_frf(system, f), channels)

    def jacobian(
        self, f: ArrayLike, names: Iterable[str], changes: Values = PRIOR_ONLY, channels: Iterable[str] | None = None
    ) -> Complex:
        """(P, F, C) derivatives of `frf` by each named parameter, per unit of its name; central differences."""
        f, base, names = frequencies(f), self._at(changes), tuple(names)
        known(names, base)
        at = replace(self, values=base)
        form = at.modal()
        wanted = form.channels if channels is None else tuple(channels)
        out = np.empty((len(names), f.size, len(wanted)), dtype=complex)
        for i, name in enumerate(names):
            h = derivative_step(name, base[name])
            same = None if is_mechanical(name) else form
            above, below = (at._unchecked(f, {**base, name: base[name] + d}, same, wanted) for d in (h, -h))
            out[i] = (above - below) / (2.0 * h)
        return out

    def poles(self, changes: Values = PRIOR_ONLY) -> Complex:
        """Poles [rad/s] of the mechanics, Im >= 0, by rising magnitude; `frequency_and_damping` reads them."""
        return self.modal(changes).poles()

    def zeros(self, channel: str, changes: Values = PRIOR_ONLY) -> Complex:
        """Zeros [rad/s] of one channel's mechanics, Im >= 0, by rising magnitude."""
        return self.modal(changes).zeros(channel)

    def _at(self, changes: Values) -> dict[str, float]:
        known(changes, self.values)
        in_range(changes)
        return {**self.values, **changes}

    def _unchecked(self, f: Array, values: Values, form: Modal | None, channels: tuple[str, ...]) -> Complex:
        """Response at values that are not judged: a derivative may look just past a bound. form: the modes, if they
        are known already."""
        at = replace(self, values=values)
        form = form or at.modal()
        return at._measured(f, values, form, form.frf(f), channels)

    def _measured(self, f: Array, v: Values, form: Modal, H: Complex, channels: Iterable[str] | None) -> Complex:
        """What the converters see of a response to one newton: constants, electronics and the optics' own effects."""
        e = electrical_of(v)
        wanted = form.channels if channels is None else tuple(channels)
        per_volt = e.gain * e.ga
        static_da = float(form.static()[form.index("da")]) * per_volt
        added = suspension(f, static_da, v["bench.mode_ratio"], v["bench.mode_Hz"], v["bench.mode_damping_ratio"])
        out = np.empty((f.size, len(wanted)), dtype=complex)
        for i, channel in enumerate(wanted):
            h = H[:, form.index(channel)] * per_volt
            if channel == "Vs":
                out[:, i] = h * e.gs * e.sensor(f) + e.crosstalk * e.gain
            else:
                out[:, i] = (h + added) * (_optics(f, v) if channel == "de" else 1.0)
        return out * e.drive(f)[:, None]


def _optics(f: Array, v: Values) -> Complex:
    """(F,) factor on de of the encoder's scale and of its head's bracket."""
    if "encoder.scale" not in v:
        return np.ones(f.shape, dtype=complex)
    return (1.0 + v["encoder.scale"]) * bracket(f, v["encoder.bracket_Hz"], v["encoder.bracket_damping_ratio"])


def frequencies(f: ArrayLike) -> Array:
    """(F,) [Hz] as an array. Raises ModelError naming a value that is not within 0..5000 Hz."""
    f = np.asarray(f, dtype=float)
    if f.ndim != 1 or f.size == 0:
        raise ModelError(f"frequencies have shape {f.shape}; expected one row of at least one")
    bad = ~((f >= 0.0) & (f <= F_MAX))
    if bad.any():
        raise ModelError(f"frequency {f[bad][0]:g} Hz is outside the model's 0..{F_MAX:g} Hz")
    return f


def frequency_and_damping(roots: NDArray[np.complex128]) -> tuple[Array, Array]:
    """Frequencies [Hz] and damping ratios of poles or zeros [rad/s]; below zero: right half plane."""
    size = np.abs(roots)
    return size / (2.0 * math.pi), -roots.real / size
