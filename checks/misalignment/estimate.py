"""The misalignment of a strut's APA from the joints' axis, by the responses of encoder, interferometer and sensor.

The table of the ratio de / da gives the starts; from them the misalignment is calibrated together with every uncertain
parameter of the strut and with the gain, delay and slow fall of the drive. An answer that the data or the model do not
support is withheld: `MisalignmentEstimate.reason` gives the reason.

The estimate is the position of the line along which the APA pushes. The metal is there too unless the APA itself is
asymmetric, and no record distinguishes the two: a model file may state how asymmetric such APAs are (`[apa]
lopsided_x_um`, with an sd), and U then holds for the metal."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from checks.arrays import Array
from checks.cause import Cause, NoResult, Reason, because
from checks.errors import ModelError
from checks.fitting.agreement import contradiction
from checks.fitting.calibrate import Calibration, quicker, refine, with_likelier_damping
from checks.fitting.common_drive import BESIDE_DA, DRIVE, OF_ONE_CHANNEL, SKEW_OF_DE, DrivenModel, mechanics
from checks.fitting.coordinates import Free
from checks.fitting.dataset import Dataset
from checks.fitting.fit import BEYOND_DOUBT, Fit, FitPoint, coarse_fits, finish, free_of
from checks.fitting.goodness import gaps
from checks.fitting.misplaced_modes import misplaced_modes, peaks
from checks.misalignment.estimate_types import DX, DY, LOPSIDED, AxisOffset, MisalignmentEstimate
from checks.misalignment.gates import TO_HZ, data_reasons, reason, sensor_tells, unobservable
from checks.misalignment.table import MisalignmentTable, table_limits_um
from checks.model.channel_paths import LATENCIES
from checks.model.joint_prior import COMMON
from checks.model.model import Model
from checks.model.parameters import is_mode_factor

RATIO_CHANNELS, SENSOR_CHANNELS = ("de", "da"), ("Vs", "de", "da")
CHANNEL_SETS = SENSOR_CHANNELS, RATIO_CHANNELS  # the sensor stack helps, but the two others suffice
# [Hz] da is lost in its noise above. Two modes from 830 Hz on may change places in a search; but without them dy and
# the encoder's masses have several values that explain as much.
F_LO, F_HI = 10.0, 1000.0
# [Hz] Both bending modes of the strut and the zeros about them lie below, and they carry most of a misalignment; a
# guide or an encoder's bracket that gives way, a filter and other effects that no model file has begin above.
BELOW_HZ, BELOW_TOP = 340.0, 0.97
LESS_MAY_TELL = {Cause.MODEL_MISFIT, Cause.RATIO_UNKNOWN}
COVERAGE = 2.0  # U = 2 u
PAYLOAD_HZ, LOST = 120.0, 3.0  # below the strut's own modes; G of a failed fit
BOTH_WAYS = 2  # fits that begin with a mode in another place
DRAWS = 3  # more starts, if one is not enough
NEAR_UM = 5.0  # places no further apart are one
WORTH_A_FIT = 50.0  # of log likelihood on few bins behind the best start
SENSOR_GAIN = ("constants.gs_V_per_m", "constants.gs_V_per_N")
OF_THE_LINE = (
    "offset of the APA's line of action from the axis of the joints; the metal of an asymmetric APA may lie elsewhere, "
    "which the records do not show"
)
OF_THE_METAL = "offset of the APA's metal from the axis of the joints; U includes the asymmetry that the model states"


def estimate_misalignment(
    model: Model, data: Dataset, table: MisalignmentTable, repeat: Dataset | None = None
) -> MisalignmentEstimate:
    """Return the misalignment from responses with the channels de and da, judged on a second realisation if there is
    one. If the modes of the model's APA are uncertain, Vs is used too if it was recorded, as long as the three agree.

    The tolerance is the model's. Raises NoResult if the data do not determine it, ModelError if the model has no
    encoder, RecordError if a channel is missing."""
    if "de" not in model.channels:
        raise ModelError(f"model {model.name} has no encoder, so no channel 'de' to compare with")
    model = with_whole_scatter(model)
    whole = _estimate_band(model, data, table, repeat, OffsetSearch())
    why = whole if isinstance(whole, Reason) else whole.reason
    if why is not None and why.cause in LESS_MAY_TELL:
        part = _estimate_band(model, data, table, repeat, OffsetSearch(f_hi=BELOW_HZ, own_paths=True))
        if isinstance(part, MisalignmentEstimate) and part.reason is None:
            at, sds = part.fit.at, part.fit.sds
            skew = f"encoder de is {at[SKEW_OF_DE]:.1f} ± {COVERAGE * sds[SKEW_OF_DE]:.1f} us behind interferometer da"
            return replace(part, notes=(f"responses above {BELOW_HZ:g} Hz are left out, so U is wider: {why}; {skew}",))
    if why is not None and (isinstance(whole, MisalignmentEstimate) or why.cause is Cause.SEARCH_FAILED):
        whole = _estimate_band(model, data, table, repeat, OffsetSearch(thorough=True))
    if isinstance(whole, Reason):
        raise NoResult(whole)
    return whole


@dataclass(frozen=True)
class OffsetSearch:
    """Settings of a search: data up to f_hi [Hz] are used; own_paths: channel delays and the gain of de are unknowns
    too; thorough: use additional starts."""

    f_hi: float = F_HI
    own_paths: bool = False
    thorough: bool = False


def _estimate_band(
    model: Model, data: Dataset, table: MisalignmentTable, repeat: Dataset | None, search: OffsetSearch
) -> MisalignmentEstimate | Reason:
    """Return the estimate from a band of the data, or the reason why they do not determine it."""
    first = _prepare(data, model, RATIO_CHANNELS, search.f_hi)
    second = None if repeat is None else _prepare(repeat, model, RATIO_CHANNELS, search.f_hi)
    for why in data_reasons(model, min(TO_HZ, BELOW_TOP * search.f_hi), first, second):
        return why
    starts = table.query(first).minima()
    if model.scatters and all(sensor_tells(d, model) for d in (data, repeat) if d is not None):
        unseen = None if repeat is None else _prepare(repeat, model, SENSOR_CHANNELS, search.f_hi)
        found = _best_fit(model, starts, _prepare(data, model, SENSOR_CHANNELS, search.f_hi), unseen, search)
        if found is not None and found.reason is None:
            return found
    found = _best_fit(model, starts, first, second, search)
    return because(Cause.SEARCH_FAILED, record=data.name, model=model.name) if found is None else found


def _prepare(data: Dataset, model: Model, channels: tuple[str, ...], f_hi: float = F_HI) -> Dataset:
    band = data.select(channels).band(F_LO, min(f_hi, model.up_to_Hz))
    return replace(band, tolerance=model.tolerance).on_bench(model.learned)


def with_whole_scatter(model: Model) -> Model:
    """Return a learned model whose parts scatter from unit to unit as far as the file states.

    Learning takes half of that variance as common to the units of a batch, the rest as scatter within it, and a few
    units show little of either. If the parts have nothing in common, all of it is scatter, the least that an interval
    has to allow for. Modes, latencies and offsets are learned separately and stay."""
    joint = model.joint
    if joint is None:
        return model
    kept = [is_mode_factor(n) or n in (*LATENCIES.values(), DX, DY) for n in joint.names]
    wider = np.where(kept, 1.0, (1.0 - COMMON) ** -0.5)
    joint = replace(joint, covariance=joint.covariance * np.outer(wider, wider))
    return replace(model, joint=joint, sds={**model.sds, **joint.sds})


def with_payload(model: Model, kg: float | None, sd_kg: float | None = None) -> Model:
    """Return the model with the payload of the unit and its uncertainty, if the unit states them."""
    if kg is None:
        return model
    sds = model.sds if sd_kg is None else {**model.sds, "bench.payload_kg": sd_kg}
    return replace(model.with_values({"bench.payload_kg": kg}), sds=sds)


def free_parameters(
    model: Model, dx: float, dy: float, channels: Sequence[str] = RATIO_CHANNELS, own_paths: bool = False
) -> list[Free]:
    """Return the free parameters: the misalignment from (dx, dy) [um] on, the uncertain mechanics, the drive, the
    sensor's gain; own_paths: also channel delays, and the gain of de relative to da."""
    own = [n for n in model.sds if not n.startswith(("constants.", "delay.", "amplifier.", "sensor.", "misalignment."))]
    places = [
        replace(p, sd=np.inf, lo=-most, hi=most, start=at, scale=most / 4)  # measured, whatever a batch foretells
        for p, at, most in zip(free_of(model, (DX, DY)), (dx, dy), table_limits_um(model), strict=True)
    ]
    gain = [n for n in SENSOR_GAIN if n in model.values and "Vs" in channels]
    gains = [replace(p, sd=np.inf, scale=0.1 * abs(p.prior)) for p in free_of(model, gain)]
    return [
        *free_of(model, [n for n in own if n not in LOPSIDED]),
        *DRIVE,
        *[p for p in BESIDE_DA if own_paths and OF_ONE_CHANNEL[p.name] in channels],
        *gains,
        *places,
    ]


def _best_fit(
    model: Model, starts: Sequence[tuple[float, float]], first: Dataset, second: Dataset | None, search: OffsetSearch
) -> MisalignmentEstimate | None:
    """Return the estimate from these channels; None if every search breaks off."""
    real = quicker(model)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        found = _fits(real, first, starts, search)
        if not found:
            return None
        alike = [c for c in found if c.fit.cost - found[0].fit.cost < BEYOND_DOUBT]
        refits = [refine(c, DrivenModel, second) for c in alike]
    best = min(refits, key=lambda c: (c.fit.datasets[0].tolerance, c.fit.cost))
    result = MisalignmentEstimate(
        dx=_along(model, best.fit, DX),
        dy=_along(model, best.fit, DY),
        model=best.model,
        fit=best.fit,
        others=_other_places(best.fit, [c.fit for c in refits if c is not best]),
        data=first,
        repeat=second,
        meaning=OF_THE_METAL if any(n in model.sds for n in LOPSIDED) else OF_THE_LINE,
    )
    result = replace(result, unknown=unobservable(result))
    return replace(result, reason=reason(result))


def _fits(
    model: Model, data: Dataset, starts: Sequence[tuple[float, float]], search: OffsetSearch
) -> list[Calibration]:
    """Return fits from the starts that lead to different places, the best first, each with the form of damping that the
    data require. If none explains the strut's own modes, one may have been taken for another: the search is repeated
    with a mode moved, and from random draws of the parameters."""
    free = [free_parameters(model, dx, dy, data.channels, search.own_paths) for dx, dy in starts]
    found = _finish_all(model, data, _distinct_places(_coarse_fits(model, data, free)))
    if search.thorough and not any(_is_another_bench(c.fit) for c in found):
        if not any(_explains(c) for c in found):
            found += _finish_all(model, data, _fits_with_moved_modes(found, data))
        if not any(_explains(c) for c in found):
            found += _finish_all(model, data, _coarse_fits(model, data, free[:1], DRAWS)[:1])
    return sorted(found, key=lambda c: c.fit.cost)


def _fits_with_moved_modes(found: Sequence[Calibration], data: Dataset) -> list[FitPoint]:
    """Return the best ends of searches that start with one mode of the best fit moved to the largest residual."""
    if not found:
        return []
    best = min(found, key=lambda c: c.fit.cost)
    fit, white = best.fit, best.fit.datasets[0].whitener
    left = white.by_bin(white(best.fit.residuals[0]))
    places = peaks(data.f, np.sum(np.abs(left) ** 2, axis=1))
    ways = misplaced_modes(best.model, fit.free, fit.at, places, float(data.f[-1]), mechanics)
    starts = [[replace(p, start=way[p.name]) for p in fit.free] for way in ways]
    return _coarse_fits(best.model, data, starts, close=True)[:BOTH_WAYS]


def _coarse_fits(
    model: Model, data: Dataset, free: Sequence[Sequence[Free]], draws: int = 0, close: bool = False
) -> list[FitPoint]:
    """Return the ends of the searches, the best first, without NaN and values that no strut has."""
    found: list[FitPoint] = []
    for each in free:
        try:
            found += coarse_fits(
                DrivenModel(model), data, each, joint=model.joint, starts=1 + draws, seed=draws, close=close
            )
        except ValueError:  # ModelError and LinAlgError are such
            continue
    return sorted(found, key=lambda point: point.cost)


def _finish_all(model: Model, data: Dataset, points: Sequence[FitPoint]) -> list[Calibration]:
    """Return the fits from these points, without those that reach values at which the assembly fails."""
    response, found = DrivenModel(model), []
    for point in points:
        try:
            fitted = Calibration(model, response, finish(response, data, point, joint=model.joint))
            found.append(with_likelier_damping(fitted, DrivenModel))
        except ValueError:  # as in `_coarse_fits`
            continue
    return found


def _distinct_places(points: Sequence[FitPoint]) -> list[FitPoint]:
    """Return the distinct ends of searches whose cost is not hopeless."""
    kept: list[FitPoint] = []
    for point in points:
        apart = all(max(abs(point.at[n] - other.at[n]) for n in (DX, DY)) > NEAR_UM for other in kept)
        if apart and point.cost < points[0].cost + WORTH_A_FIT:
            kept.append(point)
    return kept


def _explains(found: Calibration) -> bool:
    return found.fit.converged and contradiction(found.response, found.fit) is None


def _is_another_bench(found: Fit) -> bool:
    """Return whether a finished search does not explain the payload's resonance: no other start helps then."""
    low = found.datasets[0].f < PAYLOAD_HZ
    return found.converged and gaps([found.datasets[0].at(low)], [found.residuals[0][low]])["da"].G > LOST


def _along(model: Model, found: Fit, name: str) -> AxisOffset:
    """Return the misalignment along one axis. The APA's own asymmetry looks the same, so its variance is added, and
    the square of what the units of a batch have in common."""
    own = np.hypot(model.sds.get(LOPSIDED[(DX, DY).index(name)], 0.0), model.common_offset(name))
    return AxisOffset(found.at[name], COVERAGE * float(np.hypot(found.sds[name], own)))


def _other_places(best: Fit, rest: Sequence[Fit]) -> tuple[tuple[float, float], ...]:
    """Return the places of other fits that are not significantly worse than the best and lie elsewhere."""
    i = [best.names.index(n) for n in (DX, DY)]
    inverse = np.linalg.inv(best.cov[np.ix_(i, i)])
    out = []
    for s in rest:
        apart: Array = s.values[i] - best.values[i]
        same_tolerance = s.datasets[0].tolerance == best.datasets[0].tolerance
        if same_tolerance and s.cost - best.cost < BEYOND_DOUBT and apart @ inverse @ apart > 3.0**2:
            out.append((s.at[DX], s.at[DY]))
    return tuple(out)
