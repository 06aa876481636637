"""The misalignment of a strut's APA from the joints' axis, by the responses of encoder and interferometer.

The table of the ratio de / da says where to begin; from there the misalignment is fitted together with every uncertain
parameter of the strut and with the gain, delay and slow fall of the drive, which leaves the ratio to tell. An answer
that the data or the model do not carry is none: `Estimate.reason` says why.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from checks.arrays import Array
from checks.cause import Cause, NoResult
from checks.errors import ModelError
from checks.fitting.common_drive import DRIVE, Driven
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import BEYOND_DOUBT, Fit, fit, free_of
from checks.fitting.goodness import gaps
from checks.misalignment.apa_asymmetry import own_offsets
from checks.misalignment.estimate_types import DX, DY, Along, MisalignmentEstimate
from checks.misalignment.gates import data_reasons, reason
from checks.misalignment.table import DX_MAX_UM, DY_MAX_UM, MisalignmentTable
from checks.model.free_apa_modes import is_rough, softened
from checks.model.model import Model

CHANNELS = ("de", "da")
F_LO, F_HI = 10.0, 1000.0  # [Hz] da is lost in its noise above
F_HI_ROUGH = 700.0  # a rough model's modes hold to here (`frame_identify` places them up to 709 Hz)
COVERAGE = 2.0  # U = 2 u
PAYLOAD_HZ, LOST = 120.0, 3.0  # below the strut's own modes; G of a fit that has lost its way
DRAWS = 3  # more starts, where one is not enough
STEPS = 5  # of a polish


def estimate(
    model: Model, data: Dataset, table: MisalignmentTable, repeat: Dataset | None = None
) -> MisalignmentEstimate:
    """Misalignment from responses with the channels de and da, judged on a second realisation where there is one.

    The tolerance is the model's. Raises NoResult for data that cannot tell, ModelError for a model without encoder,
    RecordError for a missing channel."""
    if "de" not in model.channels:
        raise ModelError(f"model {model.name} has no encoder, so no channel 'de' to compare with")
    rough = softened(model)
    f_hi = F_HI_ROUGH if is_rough(model) else F_HI
    first, second = (_prepared(d, model, f_hi) for d in (data, repeat))
    if first is None:
        raise ModelError("no responses were given")
    for why in data_reasons(model, first, second):
        raise NoResult(why)
    places = table.query(first)
    at = of_damping(rough, "modal") or rough
    solutions = _solutions(at, first, places.minima())
    found = solutions[0]
    if at.damping == "modal":
        full = replace(rough, damping="full")
        coupled = _with_full_damping(full, found)
        found, at = (found, at) if coupled is None else (coupled, full)
    spread = _spread(model, found)
    result = MisalignmentEstimate(
        dx=_along(found, DX, spread[0]),
        dy=_along(found, DY, spread[1]),
        model=at,
        fit=found,
        others=_alike(solutions),
        map=places,
        data=first,
        repeat=second,
    )
    return replace(result, reason=reason(result))


def _prepared(data: Dataset | None, model: Model, f_hi: float) -> Dataset | None:
    return None if data is None else replace(data.select(CHANNELS).band(F_LO, f_hi), tolerance=model.tolerance)


def with_payload(model: Model, kg: float | None, sd_kg: float | None = None) -> Model:
    """The model with the payload that a unit states, if it does, and how well it is known, if it says so."""
    if kg is None:
        return model
    sds = model.sds if sd_kg is None else {**model.sds, "bench.payload_kg": sd_kg}
    return replace(model.with_values({"bench.payload_kg": kg}), sds=sds)


def free_parameters(model: Model, dx: float, dy: float) -> list[Free]:
    """What is fitted: the misalignment from (dx, dy) [um] on, the uncertain mechanics, the drive."""
    own = [n for n in model.sds if not n.startswith(("constants.", "delay.", "amplifier.", "sensor.", "misalignment."))]
    places = [
        replace(p, lo=-most, hi=most, start=at, scale=most / 4)
        for p, at, most in zip(free_of(model, (DX, DY)), (dx, dy), (DX_MAX_UM, DY_MAX_UM), strict=True)
    ]
    return [*free_of(model, own), *DRIVE, *places]


def _solutions(model: Model, data: Dataset, starts: Sequence[tuple[float, float]]) -> list[Fit]:
    """Fits from every start, the best first. Where none explains the strut's own modes, one may have been taken for
    another: then once more, from draws of its parameters. Raises NoResult when every search breaks off."""
    free = [free_parameters(model, dx, dy) for dx, dy in starts]
    found = [f for p in free if (f := _search(model, data, p)) is not None]
    if not any(_explains(f) for f in found) and not any(_another_bench(f) for f in found):
        again = _search(model, data, free[0], DRAWS)
        found += [] if again is None else [again]
    if not found:
        raise NoResult(Cause.SEARCH_FAILED, record=data.name, model=model.name)
    return sorted(found, key=lambda f: f.cost)


def _explains(found: Fit) -> bool:
    """Whether the cost, half the sum of squares of twice as many numbers as H has, is no more than these give."""
    return found.converged and found.cost < found.datasets[0].H.size


def _another_bench(found: Fit) -> bool:
    """Whether a search that ended somewhere does not explain the payload's resonance: no other start helps then."""
    low = found.datasets[0].f < PAYLOAD_HZ
    return found.converged and gaps([found.datasets[0].at(low)], [found.residuals[0][low]])["da"].G > LOST


def _search(model: Model, data: Dataset, free: Sequence[Free], draws: int = 0) -> Fit | None:
    """A fit from the start and from draws; None where it comes to values that no strut has, or no number."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return fit(Driven(model), data, free, starts=1 + draws, seed=draws)
    except ValueError:  # ModelError, LinAlgError and what least_squares says of residuals that are not finite
        return None


def _with_full_damping(model: Model, quick: Fit) -> Fit | None:
    """The fit with damping that couples the modes, where it explains the data better than real modes do.

    Whether it would is found with the derivatives of the real modes, which cost next to nothing: the two forms differ
    by little, and what they differ by is in the residual."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            x, cost = _stepped(model, replace(model, damping="modal"), quick)
    except ValueError:  # as in `_search`
        return None
    if not cost < quick.cost:
        return None
    return _search(model, quick.datasets[0], [replace(p, start=float(v)) for p, v in zip(quick.free, x, strict=True)])


def _stepped(model: Model, quick: Model, found: Fit) -> tuple[Array, float]:
    """Best of some Gauss-Newton steps with one Jacobian, that of the quick model: values (p,) and cost."""
    data, free, x = found.datasets[0], found.free, found.values
    D = Driven(quick).jacobian(data.f, found.names, found.at, data.channels)
    J = np.vstack([data.whitener(D).T, -np.diag([1.0 / p.sd for p in free])])
    unit = np.array([p.unit for p in free])
    best = x, np.inf
    for _ in range(STEPS):
        white = data.whitener(data.H - Driven(model).frf(data.f, _by_name(found.names, x), data.channels))
        r = np.concatenate([white, _off_priors(found, x)])
        cost = 0.5 * float(r @ r)
        best = (x, cost) if cost < best[1] else best
        x = np.clip(x + unit * np.linalg.lstsq(J * unit, r)[0], [p.lo for p in free], [p.hi for p in free])
    return best


def _off_priors(found: Fit, x: Array) -> Array:
    return np.array([(v - p.prior) / p.sd for p, v in zip(found.free, x, strict=True)])


def _by_name(names: Sequence[str], x: Array) -> dict[str, float]:
    return dict(zip(names, (float(v) for v in x), strict=True))


def of_damping(model: Model, damping: str) -> Model | None:
    """The model with another form of damping, or None where it cannot have it."""
    other = replace(model, damping=damping)
    try:
        other.modal()
    except ModelError:
        return None
    return other


def _spread(model: Model, found: Fit) -> tuple[float, float]:
    """Standard uncertainty [um] of dx and dy by what a rough model's modes are driven with: a misalignment, and what
    the APA does by itself, both known to the tolerance."""
    if not is_rough(model):
        return 0.0, 0.0
    dx, dy = own_offsets(model)
    return model.tolerance * float(np.hypot(found.at[DX], dx)), model.tolerance * float(np.hypot(found.at[DY], dy))


def _along(found: Fit, name: str, spread: float) -> Along:
    return Along(found.at[name], COVERAGE * float(np.hypot(found.sds[name], spread)))


def _alike(solutions: Sequence[Fit]) -> tuple[tuple[float, float], ...]:
    """Places of the solutions that are no worse than the best beyond doubt, and are not the same place."""
    best = solutions[0]
    i = [best.names.index(n) for n in (DX, DY)]
    inverse = np.linalg.inv(best.cov[np.ix_(i, i)])
    out = []
    for s in solutions[1:]:
        apart = s.values[i] - best.values[i]
        if s.cost - best.cost < BEYOND_DOUBT and apart @ inverse @ apart > 3.0**2:
            out.append((s.at[DX], s.at[DY]))
    return tuple(out)
