"""A model's uncertain parameters fitted to the responses of one unit: values, doubts about them, and pictures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from checks.arrays import Array, Complex
from checks.errors import ModelError
from checks.fitting.agreement import all_priors, outside_priors
from checks.fitting.calibrate import Calibration, calibrate
from checks.fitting.constants import Constant, fit_constants, seed_constants
from checks.fitting.dataset import Dataset
from checks.fitting.fit import Fit, own_cost, start_as_fit
from checks.fitting.goodness import Gap, gaps
from checks.model.model import Model
from checks.picture import Band, Line, Panel, PanelKind
from specs.units import RESPONSE_UNITS

BEFORE, AFTER = "model before the fit", "model fitted"
LEAST_RESIDUAL = 1e-4  # below, a picture shows nothing: no tolerance and no noise is as small


def fit_panels(data: Dataset, before: Complex, after: Complex) -> dict[str, Panel]:
    """Return the panels "<channel> magnitude", "<channel> phase", "<channel> residual" of every channel.

    before, after (F, C): the model at the bins of the data. The residual is drawn beside the 95 % band that noise and
    tolerance allow; a fit that explains stays within it 19 times in 20."""
    panels: dict[str, Panel] = {}
    for c, name in enumerate(data.channels):
        curves = {"measured": data.H[:, c], BEFORE: before[:, c], AFTER: after[:, c]}
        panels[f"{name} magnitude"] = _magnitude(data.f, name, curves)
        panels[f"{name} phase"] = _phase(data.f, name, curves)
        panels[f"{name} residual"] = _residual(data, c, before[:, c], after[:, c])
    return panels


def frf_panels(f: Array, H: Complex, channels: tuple[str, ...]) -> dict[str, Panel]:
    """Return the magnitude and phase of a model's responses H (F, C) alone."""
    panels: dict[str, Panel] = {}
    for c, name in enumerate(channels):
        panels[f"{name} magnitude"] = _magnitude(f, name, {"model": H[:, c]})
        panels[f"{name} phase"] = _phase(f, name, {"model": H[:, c]})
    return panels


_ROLES = {"measured": "data", BEFORE: "before", AFTER: "model", "model": "model"}


def _magnitude(f: Array, name: str, curves: Mapping[str, Complex]) -> Panel:
    lines = tuple(Line(f, np.abs(H), label, _style(label), _ROLES[label]) for label, H in curves.items())
    label = f"|{name} / Va| [{RESPONSE_UNITS.get(name, '')}]"
    return Panel(f"{name} / Va", "frequency [Hz]", label, lines, x_log=True, y_log=True)


def _phase(f: Array, name: str, curves: Mapping[str, Complex]) -> Panel:
    lines = tuple(Line(f, np.degrees(np.angle(H)), label, "points", _ROLES[label]) for label, H in curves.items())
    return Panel(
        f"{name} phase",
        "frequency [Hz]",
        "phase [deg]",
        lines,
        x_log=True,
        y_range=(-190.0, 190.0),
        kind=PanelKind.PHASE,
    )


def _residual(data: Dataset, c: int, before: Complex, after: Complex) -> Panel:
    size = np.abs(data.reference[:, c])
    allowed = np.sqrt(-np.log(0.05) * data.variance[:, c]) / size  # of a complex normal error of this variance
    left = {BEFORE: np.abs(data.H[:, c] - before) / size, AFTER: np.abs(data.H[:, c] - after) / size}
    lines = tuple(
        Line(data.f, np.maximum(r, LEAST_RESIDUAL), label, _style(label), _ROLES[label]) for label, r in left.items()
    )
    band = Band(
        data.f,
        np.full(data.f.size, LEAST_RESIDUAL),
        np.maximum(allowed, LEAST_RESIDUAL),
        "within noise and tolerance (95 %)",
    )
    title = f"{data.channels[c]} residual"
    return Panel(title, "frequency [Hz]", "|data - model| / |model|", (band, *lines), x_log=True, y_log=True)


def _style(label: str) -> str:
    return "dashed" if label == BEFORE else "solid"


SEARCH = "the gap analysis (analyse_gap, accept gap) looks for the cause"
WITHIN_DECADES = 0.5  # of a power of 1000: what else differs between a strut and its model is less
OPPOSITE = 0.9  # median of the cosine between response and model
AGREES = 1.1  # of G: 1 within the scatter of some hundred bins


@dataclass(frozen=True, eq=False)
class ModelFit:
    """A fit and its start. first: the responses that were fitted; before, after: G of the model at its file's
    tolerance, about the model itself; held_out: G of the fitted model on the second realisation, empty without one;
    outside: which values the model's file does not allow, or None."""

    start: Model
    model: Model
    fit: Fit
    first: Dataset
    before: Mapping[str, Gap]
    after: Mapping[str, Gap]
    held_out: Mapping[str, Gap]
    seed_constants: Mapping[str, float]
    constants: Mapping[str, Constant]
    outside: str | None

    @staticmethod
    def of(start: Model, first: Dataset, unseen: Dataset | None, starts: int, say: Callable[[str], None]) -> "ModelFit":
        """Fit a model's parameters. unseen: a second realisation; starts: of the search. Raises ModelError."""
        found = calibrate(start, first, unseen=unseen, starts=starts)
        # the state before it, if the search ended farther from the data than it began
        before = start_as_fit(start, first, found.fit, "the search ended farther from the data than it began")
        own = replace(found.fit, datasets=tuple(replace(s, tolerance=first.tolerance) for s in found.fit.datasets))
        found = found if own_cost(own) <= own_cost(before) else Calibration(start, start, before)
        at = found.model.with_values(found.fit.at)
        by_seed, constants = _constants(at, first, say)
        return ModelFit(
            start=start,
            model=at,
            fit=found.fit,
            first=first,
            before=_gaps(start, first),
            after=_gaps(at, first, found.fit.effective_parameters if found.fit.converged else 0.0),
            held_out={} if unseen is None else _gaps(at, unseen),
            seed_constants=by_seed,
            constants=constants,
            outside=_outside(found.fit),
        )

    @property
    def worst(self) -> tuple[str, float]:
        """Return the channel with the largest G, on data that were not fitted if there are any, and that G."""
        by_channel = self.held_out or self.after
        channel = max(by_channel, key=lambda c: by_channel[c].G)
        return channel, by_channel[channel].G

    @property
    def explains(self) -> bool:
        """Return whether the fitted model is one that its file allows and agrees with the unit."""
        return self.doubt is None

    @property
    def doubt(self) -> str | None:
        """Return why the fitted values must not be used, None if they explain the unit."""
        channel, G = self.worst
        if self.fit.converged and self.outside is None and G <= AGREES:
            return None
        if scale := _scale_of(self.start, self.first):
            return scale
        if not self.fit.converged:
            return f"the fit did not converge ({self.fit.message}); {SEARCH}"
        return self.outside or f"G of {channel} is {G:.3g}, agreement is 1 or less; {SEARCH}"

    @property
    def panels(self) -> dict[str, Panel]:
        """Return the magnitude, phase and residual of every channel."""
        data = self.fit.datasets[0]
        before, after = (m.frf(data.f, channels=data.channels) for m in (self.start, self.model))
        return fit_panels(data.around(after), before, after)


def _outside(found: Fit) -> str | None:
    """Return the values outside the model file's bounds, with the reason."""
    reason = next(chain(outside_priors(found), all_priors(found)), None)
    return None if reason is None else str(reason)


def _scale_of(model: Model, data: Dataset) -> str | None:
    """Return the channel that is a power of 1000 larger than the model's, or of opposite sign, over most of the band.
    No value of a strut explains that; another unit or a plug does."""
    ratios = data.H / model.frf(data.f, channels=data.channels)
    for channel, size, turned in zip(
        data.channels, np.median(np.abs(ratios), axis=0), np.median(ratios.real / np.abs(ratios), axis=0), strict=True
    ):
        power = 3 * round(np.log10(size) / 3) if size > 0 else 0
        if power and abs(np.log10(size) - power) < WITHIN_DECADES:
            return f"{channel} is 1e{power} times what the model has: is it in another unit?"
        if turned < -OPPOSITE:
            return f"{channel} has the opposite sign of what the model has: check its polarity"
    return None


def _gaps(model: Model, data: Dataset, fitted: float = 0.0) -> dict[str, Gap]:
    """Return G of a model. fitted: how many of its parameters these data determined, 0 if they were not fitted."""
    H = model.frf(data.f, channels=data.channels)
    return gaps([data.around(H)], [data.H - H], fitted)


def _constants(
    model: Model, data: Dataset, say: Callable[[str], None]
) -> tuple[Mapping[str, float], Mapping[str, Constant]]:
    """Estimate ga and gs by the formulas of [STB] 4.2.1 and by least squares; empty without the bands they need."""
    H = {c: data.H[:, i] for i, c in enumerate(data.channels)}
    variance = {c: data.noise[:, i] for i, c in enumerate(data.channels)}
    if "Vs" not in H or not H.keys() & {"de", "da"}:
        return {}, {}
    de = H["de"] if "de" in H else H["da"]
    try:
        return seed_constants(model, data.f, de, H["Vs"]), fit_constants(model, data.f, H, variance)
    except ModelError as e:
        say(f"no constants by the published formulas: {e}")
        return {}, {}
