"""From a model file's description to a model that can be evaluated."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from checks.errors import ModelError
from checks.model.free_apa_modes import modal_apa, mode_names
from checks.model.joint_prior import JointPrior
from checks.model.learned_bench import LearnedBench
from checks.model.model import Model, Values
from checks.model.parameters import in_range, is_mode_factor, known, si
from checks.model.structure.apa import ApaBody, superelement_body
from checks.model.structure.apa_2dof import two_dof_body
from checks.model.structure.attached import check_elements
from checks.model.structure.frame import frame_matrices
from checks.model.structure.frame_geometry import FrameGeometry
from checks.model.structure.static_reduction import KEEP_ALL_HZ, KEEP_HZ, reduce_apa
from checks.model.structure.superelement import Nodes, Superelement
from checks.model.structure.superelement_check import check_superelement
from specs.model import ModelSpec
from specs.model_sections import ApaFrame, ApaOfModes, ApaSuperelement
from specs.models.parameters import off_values

# Five times the end of the band: beyond, a fifth more damping of a mode changes less than 1e-3 of what the mode adds
# to a response within, which is a few percent of it.
DAMPED_HZ = 10e3


@dataclass(frozen=True, eq=False)
class FixedBody:
    """An APA whose matrices depend on no parameter; a class, not a closure, so that a model can be pickled."""

    body: ApaBody

    def __call__(self, _: Values) -> ApaBody:
        return self.body


def build_model(spec: ModelSpec, superelement: Superelement | None = None, reduced: bool = True) -> Model:
    """Return the model of a description. superelement: the matrices of `spec.apa_file`, if the APA is one.

    reduced=False keeps every coordinate of the APA: slow, to test the reduction. The list `spec.effects` is not
    applied here. Raises ModelError."""
    parts = () if spec.encoder is None else ("encoder",)
    values = off_values("amplifier", "bench", *parts) | spec.values
    in_range(values)
    check_elements(values)
    apa, matrices = _apa(spec, superelement, reduced)
    sha256 = hashlib.sha256(spec.sha256.encode() + matrices).hexdigest()
    apa, more, sds = _with_mode_factors(spec, apa)
    batch = spec.population  # the batch's information on the unit, if the file names one
    joint = None if batch is None else JointPrior(tuple(batch.names), np.array(batch.mean), np.array(batch.full))
    values = {**values, **more, **({} if joint is None else joint.values)}
    known(() if joint is None else joint.names, {**spec.sds, **sds})
    in_range(values)
    return Model(
        name=spec.name,
        apa=apa,
        values=values,
        sds={**spec.sds, **sds, **({} if joint is None else joint.sds)},
        joint=joint,
        learned=_learned_bench(spec),
        tolerance=spec.tolerance.relative,
        least=_least_tolerance(spec),
        sha256=sha256,
        damping=spec.damping,
        up_to_Hz=spec.tolerance.up_to_Hz,
    )


def _least_tolerance(spec: ModelSpec) -> float:
    """Return the tolerance that a fit may fall to if the data bear it. On a learned bench it stays that of the file:
    the error of a learned factor is common to all bins about it, and noise that is counted bin by bin would turn it
    into a misalignment with a U two to seven times too small."""
    if spec.learned_bench is not None:
        return spec.tolerance.relative
    return min(spec.tolerance.least, spec.tolerance.relative)


def _learned_bench(spec: ModelSpec) -> LearnedBench | None:
    """Return the unexplained factor that the bench puts on every unit, if the file holds one."""
    record = spec.learned_bench
    if record is None:
        return None
    parts = list(record.channels.values())
    factor, sd, tolerance = (
        np.array(columns).T
        for columns in (
            [np.array(p.real) + 1j * np.array(p.imag) for p in parts],
            [p.sd for p in parts],
            [p.tolerance for p in parts],
        )
    )
    return LearnedBench(np.array(record.f_Hz), tuple(record.channels), factor, sd, tolerance)


def _with_mode_factors(
    spec: ModelSpec, apa: Callable[[Values], ApaBody]
) -> tuple[Callable[[Values], ApaBody], dict[str, float], dict[str, float]]:
    """Return the APA with factors on its free modes, if the file states that these differ from unit to unit: body,
    values and prior standard deviations of the factors. A stiffness goes with the square of a frequency; every one
    counts in the compliance, but the damping of a mode far above the band changes nothing within."""
    if not isinstance(spec.apa, ApaOfModes) or spec.apa.mode_scatter is None or not isinstance(apa, FixedBody):
        return apa, {}, {}
    modal, scatter = modal_apa(apa.body), spec.apa.mode_scatter
    stiffness, damping = mode_names(modal.modes)
    heard = damping[: modal.below(DAMPED_HZ)]
    values = {n: spec.values.get(n, 1.0) for n in (*stiffness, *damping)}
    sds = dict.fromkeys(stiffness, 2.0 * scatter.frequency) | dict.fromkeys(heard, scatter.damping)
    sds |= {n: sd for n, sd in spec.sds.items() if n in values}
    beyond = [n for n in spec.values if is_mode_factor(n) and n not in values]
    if beyond:
        raise ModelError(f"{spec.name}: {beyond[0]}, but the reduced APA has {modal.modes} elastic modes")
    return modal, values, {n: sd for n, sd in sds.items() if sd > 0.0}


def file_nodes(spec: ModelSpec) -> Nodes:
    """Return the interface nodes of a superelement's description, counted from 0."""
    if not isinstance(spec.apa, ApaSuperelement):
        raise ModelError(f"{spec.name}: apa.type is '{spec.apa.type}', only a superelement names its nodes")
    n = spec.apa.nodes
    (s1, s2), (a1, a2) = n.sensor, n.actuator
    return Nodes(n.bottom - 1, n.top - 1, (s1 - 1, s2 - 1), (a1 - 1, a2 - 1))


def _apa(spec: ModelSpec, s: Superelement | None, reduced: bool) -> tuple[Callable[[Values], ApaBody], bytes]:
    """Return the APA as a function of the values, and the bytes of its matrices for the hash."""
    if isinstance(spec.apa, ApaFrame):
        # All nodes of the frame, reduced to its two ends below: more accurate than `frame_apa` and as cheap.
        K, M, points = frame_matrices(_replace_fields(FrameGeometry(), spec.apa.geometry, "apa.geometry"))
        s = Superelement(K, M, points, name="frame APA")
    elif not isinstance(spec.apa, ApaSuperelement):
        return _two_dof, b""
    if s is None:
        raise ModelError(f"{spec.name}: needs the superelement of {spec.apa_file}")
    body = superelement_body(check_superelement(s))
    keep_Hz = KEEP_HZ if spec.apa.mode_scatter is None else KEEP_ALL_HZ
    body = reduce_apa(body, keep_Hz) if reduced else body
    return FixedBody(body), s.K.tobytes() + s.M.tobytes()


def _replace_fields(part: Any, changes: Mapping[str, Any], path: str) -> Any:
    """Return a frozen part with entries of the same names replaced, parts within parts too. Raises ModelError."""
    entries = {f.name for f in fields(part)}
    for key in changes:
        if key not in entries:
            raise ModelError(f"[{path}] has no '{key}' (has: {', '.join(sorted(entries))})")
    return replace(part, **{key: _entry(getattr(part, key), new, f"{path}.{key}") for key, new in changes.items()})


def _entry(old: Any, new: Any, path: str) -> Any:
    if is_dataclass(old) and isinstance(new, Mapping):
        return _replace_fields(old, new, path)
    if isinstance(old, tuple) and isinstance(new, list) and len(new) == len(old) and all(map(_is_number, new)):
        return tuple(float(v) for v in new)
    if isinstance(old, float) and _is_number(new):
        return float(new)
    raise ModelError(f"[{path}] is {new!r}; expected the like of {old!r}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _two_dof(values: Values) -> ApaBody:
    k, ke, ka = (si(values, f"apa.{name}_N_per_um") for name in ("k", "ke", "ka"))
    c, ce, ca = (values[f"apa.{name}_N_s_per_m"] for name in ("c", "ce", "ca"))
    return two_dof_body(k, ke, ka, c, ce, ca, si(values, "apa.height_mm"))
