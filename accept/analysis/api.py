"""The names that `import accept` offers in a script or a notebook; stable, typed, each a few lines over the same code
that the commands use. Nothing here is imported before it is asked for: `import accept` itself stays light."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from accept.analysis.arguments import ArgumentError as ArgumentError
from accept.analysis.arguments import checked
from accept.analysis.given_responses import Given
from accept.analysis.given_responses import dataset as dataset
from accept.analysis.hammer import ImpactResponse, hammer_responses
from accept.analysis.imported_response import ImportedResponse, import_response
from accept.analysis.misalignment import estimate_unit
from accept.analysis.model_export import save_state_space
from accept.analysis.model_export import to_control as as_control
from accept.analysis.model_fit import FittedModel, fit_unit
from accept.analysis.record_responses import OF_RECORDS, MeasuredResponse, read_any, responses_of
from accept.base.documents.results import UnitRecord
from accept.gap import GapAnalysis, Responses
from accept.gap import analyse as _analyse
from accept.gap import responses as unit_responses
from accept.judging import default_spec, judge_unit, load_spec
from accept.models.model_file import SIMULATED_MODEL, default_model
from accept.models.model_file import open_model as _open_model
from accept.pictures.draw import figure_of, picture
from accept.pictures.formats import PictureError, format_of
from accept.pictures.interactive import page
from accept.pictures.items import draw_panel
from accept.simulate import UnitRequest, UnitRequestError
from accept.simulate import simulate as _simulate
from accept.units import LoadedUnit, loaded
from checks.cause import NoResult as NoResult
from checks.errors import RecordError
from checks.fitting import F_HI, F_LO, Calibration, Dataset, Fit, fit_panels, frf_panels
from checks.gap import bode_panels
from checks.misalignment import MisalignmentEstimate
from checks.misalignment import misalignment_panels as misalignment_panels
from checks.model import Model, StateSpace
from checks.picture import Panel
from checks.record import Record
from checks.signals import Estimator, EstimatorSettings, Frf, ImpactRules, bode
from specs.errors import AcceptError as AcceptError
from specs.units import RESPONSE_UNITS

UnitLike = str | Path | LoadedUnit
Drawable = (
    UnitRecord
    | MeasuredResponse
    | MisalignmentEstimate
    | FittedModel
    | GapAnalysis
    | Model
    | StateSpace
    | Responses
    | Dataset
    | Fit
    | Calibration
    | Mapping[str, Panel]
    | Panel
)


@checked
def read_unit(folder: str | Path) -> LoadedUnit:
    """Return the unit in a folder with a `unit.toml`; its files are read when they are first needed, and once.

    Args:
        folder: the unit's folder.

    Returns:
        The unit, for `judge`, `responses`, `fit_model`, `estimate_misalignment` and `analyse_gap`. Raises UnitError for
        a folder that holds no usable unit."""
    return loaded(_file(folder))


@checked
def judge(unit: UnitLike, spec: str | None = None) -> UnitRecord:
    """Judge a unit: return its findings and verdict.

    Args:
        unit: its folder, or what `read_unit` returned.
        spec: a built-in name or a TOML file; without it the unit's kind picks.

    Returns:
        `result.verdict`, `result.findings`, each with `quantity`, `value`, `U` (k = 2), limits and `verdict`;
        `accept.plot(result)` draws the measurements. Bad records raise nothing: their findings are `no_result`, with
        the reason. Raises UnitError, SpecError.

    Examples:
        >>> [(f.quantity, f.value, f.U, f.verdict) for f in accept.judge("units/S-02").findings]  # doctest: +SKIP"""
    held = _loaded_unit(unit)
    return judge_unit(held, load_spec(spec) if spec else default_spec(held.folder.kind))


@checked
def read_record(
    file: str | Path, input: str = "Va", *, channels: Mapping[str, str] | None = None, step_s: float | None = None
) -> Record:
    """Return every vector of a record file that is as long as its input, in SI.

    Args:
        file: .mat (5 to 7.3), .csv, .uff or .tdms. Units in headers (`de [nm]`) are converted, and this is said.
        input: name of the channel that drives.
        channels: name here -> name in the file, {"Va": "data.ch3"}.
        step_s: sampling time [s] of a file without a time.

    Returns:
        `record["Va"]` (N,), `record.t` (N,) [s], `record.fs` [Hz], `record.units`. Raises RecordError, which says what
        the file holds."""
    return read_any(_file(file), input, channels or {}, step_s)


@checked
def frequency_response(
    *records: Record | str | Path,
    input: str = "Va",
    estimator: str = "auto",
    segment_s: float = 0.5,
    f_lo: float = 0.0,
    f_hi: float | None = None,
    merge_Hz: float | None = None,
) -> MeasuredResponse:
    """Estimate the response of every channel over the input [unit per V], with coherence, variance and resonances.

    Args:
        records: one file or record; or two, low and high, with merge_Hz.
        input: name of the channel that drives.
        estimator: "auto" (over the periods of a periodic input, else "h1"), "h1" (Hann segments), "lpm" (local
            polynomials: no leakage, one record suffices).
        segment_s: length of the segments of h1 [s].
        f_lo: lower end of the band that is kept [Hz].
        f_hi: its upper end [Hz].
        merge_Hz: the first record up to here, the second above [Hz].

    Returns:
        `response.frf.f` (F,) [Hz], `.H` (F, C) complex, `.coherence` (F, C), `.var` (F, C);
        `response.resonances[channel]` with `f_Hz` and `damping_ratio`. `to_pandas`, `to_xarray`, `to_control` and
        `save` hand it on. Raises RecordError; hits of a hammer are refused: `hammer_response` is for them.

    Examples:
        >>> response = accept.frequency_response("low.mat", estimator="lpm", f_lo=10, f_hi=400)  # doctest: +SKIP"""
    if len(records) > 1 and merge_Hz is None:
        raise ArgumentError(
            f"frequency_response: {len(records)} records and no merge_Hz, so all but one would be left out; merge_Hz "
            "joins two, low and high; estimate realisations one by one"
        )
    if estimator not in list(OF_RECORDS):
        raise RecordError(f"estimator = '{estimator}': expected one of {', '.join(OF_RECORDS)}")
    if not records:
        raise ArgumentError("frequency_response: name one record, or two to be joined")
    read = [r if isinstance(r, Record) else read_record(r, input) for r in records]
    return responses_of(read, EstimatorSettings(Estimator(estimator), segment_s, f_lo, f_hi, input, merge_Hz))[0]


@checked
def hammer_response(
    *records: Record | str | Path,
    input: str = "Track1",
    estimator: str = "h1",
    f_lo: float = 0.0,
    f_hi: float | None = None,
    block_s: float = 4.0,
    window_decay: float | None = None,
    double_hit_ms: float = 100.0,
    double_hit_share: float = 0.03,
    ringing_samples: float = 5.0,
    force_range_N: float | None = None,
) -> ImpactResponse:
    """Estimate the response of every channel over the force of a hammer, from the good hits of one or several records.

    Hits are found in the force; double hits, overloads and hits that disagree are set aside with the reason. A force
    window ends the force after the hit, an exponential window a decay that the block cuts; the damping that it adds is
    subtracted from the modes.

    Args:
        records: files or records, alike in channels and sampling rate.
        input: name of the force [N].
        estimator: "h1" (noise on the responses), "h2" (noise on the force), "hv" (their geometric mean).
        f_lo: lower end of the band that is kept [Hz].
        f_hi: its upper end [Hz]; without it 1/2.56 of the sampling rate, where an analyser's filter cuts.
        block_s: longest block after a hit [s]; a lightly damped structure needs longer ones.
        window_decay: decay rate [1/s] of the exponential window; None for what a cut decay needs, 0 for none.
        double_hit_ms: a second peak so soon after a hit makes it a double hit, as of `spurious_modes`.
        double_hit_share: least part of the first peak that the second one has.
        ringing_samples: samples for which the analyser's filter rings after a hit.
        force_range_N: range of the force sensor; without it overloads show by their flat tops only.

    Returns:
        `response.frf` as of `frequency_response`, with coherence over the hits and the variance of their scatter;
        `response.modes[channel]`, each with `f_Hz` and `damping_ratio`; `response.impacts[file]`, each with `fault`,
        None for a good one. Raises RecordError if fewer than two hits are good.

    Examples:
        >>> struck = accept.hammer_response("hits_1.mat", "hits_2.mat", input="force")  # doctest: +SKIP
        >>> accept.plot(struck).save("hits.pdf")  # doctest: +SKIP"""
    if not records:
        raise ArgumentError("hammer_response: name one record, or several of the same test")
    read = [r if isinstance(r, Record) else read_record(r, input) for r in records]
    rules = ImpactRules(
        double_hit_s=double_hit_ms / 1e3,
        double_hit_share=double_hit_share,
        ringing_samples=ringing_samples,
        block_max_s=block_s,
        force_range_N=force_range_N,
        window_decay=window_decay,
    )
    return hammer_responses(read, input, estimator, f_lo, f_hi, rules)


@checked
def read_response(
    file: str | Path,
    input: str = "",
    *,
    channels: Mapping[str, str] | None = None,
    averages: float | None = None,
    noise: float | None = None,
) -> ImportedResponse:
    """Return the frequency response in a file of an analyser or of another program.

    Universal files (data set 58, function type 4, with coherence of type 6), MATLAB (a struct with the fields of an frd
    object; complex vectors beside one of frequencies; H1_2 with C1_2), tables with columns `de_re [m/V]` and `de_im
    [m/V]`, dB and degrees or complex numbers, and what this program writes itself. What a file states of its units,
    phase and noise is used, or the file is refused with the reason.

    Args:
        file: .uff, .mat, .csv or .json.
        input: name of the input, of several the one to take; by default that of the file, else by its unit: force for
            N, Va without one.
        channels: name here -> name in the file, {"de": "H1_2"}; "f" for the frequencies.
        averages: how many averages are behind the coherence that the file states.
        noise: relative standard deviation of the response, if the file states neither variance nor averages.

    Returns:
        A response as of `frequency_response`, for `fit_model`, `estimate_misalignment`, `plot` and `save`. What the
        file does not state stays unknown: without noise it is not fitted, and there is no second realisation to judge
        with. Raises RecordError, which says what the file holds.

    Examples:
        >>> theirs = accept.read_response("analyser.uff", averages=20)  # doctest: +SKIP"""
    return import_response(_file(file), input, channels, averages, noise)


@checked
def responses(unit: UnitLike, f_lo: float = F_LO, f_hi: float = F_HI) -> Responses:
    """Return the responses that a unit names under [frf], on independent bins.

    Args:
        unit: its folder, or what `read_unit` returned.
        f_lo: lower end of the band [Hz].
        f_hi: its upper end [Hz].

    Returns:
        `found.first` and `found.second` (another realisation, or None), each with `.f` (F,) [Hz], `.H` (F, C) over Va
        at the DAC, `.cov` (F, C, C), `.channels`. Records that judging refuses are refused. Raises UnitError,
        RecordError."""
    return unit_responses(_loaded_unit(unit), f_lo=f_lo, f_hi=f_hi)


@checked
def open_model(name: str | Path = "strut") -> Model:
    """Return a built-in model or a model file.

    Args:
        name: "strut", "strut-as-built", "strut-plates", "strut-2dof", "apa-frame", "apa-2dof", or a
            TOML file.

    Returns:
        `model.frf(f)` (F, C) complex over Va at the DAC, `model.poles()` [rad/s], `model.values`, `model.sds`,
        `model.with_values({...})`. Raises SpecError, ModelError.

    Examples:
        >>> accept.open_model("strut").with_values({"misalignment.dy_um": 100.0}).frf([95.0])  # doctest: +SKIP"""
    return _open_model(name)


def to_ss(model: Model | str | Path) -> StateSpace:
    """Return the state space of a model from Va at the DAC [V] to Vs [V], de and da [m].

    Args:
        model: what `open_model` returned, or its name or file.

    Returns:
        `found.A` (n, n), `.B` (n, 1), `.C` (p, n), `.D` (p, 1), names under `.outputs`, and `.delay_s` (p,) [s], which
        no matrix holds; `found.frf(f)` is the model's response. What a learned bench adds is left out. Raises
        ModelError.

    `accept.to_control(found)` makes an object of python-control, `accept.save_ss(found, "F.mat")` a MATLAB struct."""
    return StateSpace.of(model if isinstance(model, Model) else open_model(model))


@checked
def to_control(found: StateSpace, pade: int | None = None) -> Any:
    """Return a state space as an object of python-control, with its names.

    pade: order of the approximation of the delays; without it a state space with delays raises ModelError. Raises
    RecordError if python-control is not installed."""
    if not isinstance(found, StateSpace):
        raise ArgumentError(f"to_control takes what to_ss returned, not a {type(found).__name__}")
    return as_control(found, pade)


@checked
def save_ss(found: StateSpace, file: str | Path) -> Path:
    """Write a state space as a MATLAB file that one line opens as `ss`. Raises ModelError unless it ends in .mat."""
    if not isinstance(found, StateSpace):
        raise ArgumentError(f"save_ss takes what to_ss returned, not a {type(found).__name__}")
    return save_state_space(found, _file(file))


@checked
def fit_model(
    unit: UnitLike | Given, model: str | None = None, f_lo: float = F_LO, f_hi: float = F_HI, starts: int = 3
) -> FittedModel:
    """Fit the model's uncertain parameters to the responses of a unit, with priors and tolerance.

    Args:
        unit: a folder, or what `read_unit`, `responses`, `frequency_response`, `read_response` or `dataset` returned.
        model: built-in name or file; by default that of the unit's kind.
        f_lo: lower end of the band that is fitted [Hz].
        f_hi: its upper end [Hz].
        starts: of the search.

    Returns:
        `fitted.fit.at` (name -> value), `.fit.sds` (name -> standard uncertainty), `.fit.cov`; `.before`, `.after` and,
        if there is a second realisation, `.held_out`: G by channel, 1 or less is agreement. `fitted.explains` says
        whether the values may be used, `fitted.doubt` why not. Raises UnitError, RecordError, SpecError, ModelError."""
    return fit_unit(unit if isinstance(unit, Given) else _loaded_unit(unit), model, f_lo, f_hi, starts)


@checked
def estimate_misalignment(unit: UnitLike | Given, model: str | None = None) -> MisalignmentEstimate:
    """Estimate how far the APA of a strut is off the joints' axis.

    Args:
        unit: as of `fit_model`; responses must hold de and da.
        model: built-in name or file; by default "strut-as-built".

    Returns:
        `found.dx`, `found.dy` with `.value` and `.U` [um], k = 2; `accept.plot(found)` draws the map. Raises NoResult
        if the data cannot tell, UnitError, RecordError, ModelError."""
    return estimate_unit(unit if isinstance(unit, Given) else _loaded_unit(unit).folder, model)


@checked
def analyse_gap(
    unit: UnitLike, model: str | Path | None = None, *, without: Sequence[str] = (), say: Callable[[str], None] = print
) -> GapAnalysis:
    """Return what the model does not explain, by name. Takes up to a minute.

    Args:
        unit: a folder, or what `read_unit` returned. Responses do not suffice: a second realisation is compared with.
        model: built-in name or file to start from; by default that of the unit's kind.
        without: effects that are left out of the library.
        say: takes a line at each stage; print by default.

    Returns:
        `found.result.verdict`, `.named`, `.gap_before`, `.gap_after`; `found.document` is the content of gap.json.
        Raises UnitError, RecordError, SpecError, GapRefused, and ModelError also for an unknown effect in `without`."""
    if isinstance(unit, Given):
        raise ArgumentError(
            "analyse_gap needs the records of a unit: it compares with a second realisation that was not fitted, and "
            "asks the records themselves; fit_model and estimate_misalignment take responses"
        )
    held = _loaded_unit(unit)
    return _analyse(held, model or default_model(held.folder.kind), without, say)


@checked
def simulate_unit(
    folder: str | Path, kind: str = "strut", *, seed: int = 0, values: Mapping[str, float] | None = None
) -> LoadedUnit:
    """Return a simulated unit with its records, written to a new folder.

    Args:
        folder: a folder that is not there yet; its name is the serial.
        kind: "strut", "strut-plates" (without encoder) or "apa".
        seed: of the noise.
        values: of the model, {"misalignment.dy_um": -120}.

    Returns:
        The unit, as of `read_unit`. Raises ModelError, and UnitRequestError also for a folder that is there already."""
    place = _file(folder)
    if kind not in SIMULATED_MODEL:
        raise UnitRequestError(f"kind = '{kind}': expected one of {', '.join(SIMULATED_MODEL)}")
    if place.exists():
        raise UnitRequestError(f"{place}: is there already; name a folder that is not, or remove this one")
    model = _open_model(SIMULATED_MODEL[kind]).with_values(dict(values or {}))
    simulated = _simulate(UnitRequest(place.name, kind, model, seed=seed))
    place.mkdir(parents=True)
    for name, content in simulated.files.items():
        (place / name).write_bytes(content)
    return read_unit(place)


@dataclass(frozen=True, eq=False)
class Plot:
    """Panels to look at: a notebook shows them, `save` writes .png, .pdf, .svg, or .html to zoom in."""

    panels: Mapping[str, Panel]
    title: str = ""

    def __repr__(self) -> str:
        return f"Plot({self.title}: {', '.join(self.panels)})"

    def save(self, file: str | Path) -> Path:
        """Write the picture; the ending chooses the format. Raises PictureError."""
        place = _file(file)
        shown = list(self.panels.values())
        interactive = place.suffix.lower() == ".html"
        place.write_bytes(page(self.panels, self.title) if interactive else picture(shown, format_of(place)))
        return place

    def draw(self, ax: Any) -> None:
        """Draw the panels onto axes of matplotlib, one after the other; those that have no axes are left out. Raises
        PictureError if these are no axes."""
        several = list(np.ravel(np.asarray(ax, dtype=object)))
        if not several or not all(hasattr(each, "set_xscale") for each in several):
            raise PictureError(f"ax is a {type(ax).__name__}; expected axes of matplotlib, or several")
        for each, panel in zip(several, self.panels.values(), strict=False):
            draw_panel(each, panel)

    @property
    def figure(self) -> Any:
        """Return a matplotlib figure with all panels."""
        return figure_of(list(self.panels.values()))

    def _repr_png_(self) -> bytes:
        return picture(list(self.panels.values()), "png")


@checked
def plot(what: Drawable, ax: Any = None, panels: Sequence[str] | None = None) -> Plot:
    """Draw what another function returned, or a model, a dataset, a fit.

    Args:
        what: a result, response, model, fit, misalignment, gap analysis, or panels.
        ax: axes of matplotlib, or several: panels are drawn onto them in order, and no picture of its own is made.
        panels: names of panels, in order; all by default. `accept.plot(what).panels` lists them.

    Returns:
        A `Plot`: a notebook shows it, `save("x.pdf")` writes it. Raises PictureError if there is no such picture.

    Examples:
        >>> accept.plot(response, ax=plt.subplot(), panels=["de magnitude"])  # doctest: +SKIP"""
    drawn = _picture_of(what)
    if panels is not None:
        if missing := [name for name in panels if name not in drawn.panels]:
            raise PictureError(f"{drawn.title}: no panel '{missing[0]}'; it has {', '.join(drawn.panels)}")
        drawn = Plot({name: drawn.panels[name] for name in panels}, drawn.title)
    if ax is not None:
        drawn.draw(ax)
    return drawn


def _picture_of(what: Drawable) -> Plot:
    match what:
        case Panel():
            return Plot({what.title: what}, what.title)
        case UnitRecord():
            return Plot(what.panels, what.serial)
        case ImpactResponse():
            return Plot(what.panels, what.title)
        case MeasuredResponse():
            return Plot(bode(what.frf, what.ratios), what.title)
        case MisalignmentEstimate():
            return Plot(misalignment_panels(what), "misalignment")
        case FittedModel():
            return Plot(what.panels, what.measured.serial)
        case GapAnalysis():
            return Plot(bode_panels(what.result), what.measured.serial)
        case Model():
            f = np.geomspace(10.0, min(2000.0, what.up_to_Hz), 1000)
            return Plot(dict(frf_panels(f, what.frf(f), what.channels)), what.name)
        case StateSpace():
            f = np.geomspace(10.0, 2000.0, 1000)
            return Plot(dict(frf_panels(f, what.frf(f), what.outputs)), what.name)
        case Responses():
            return _picture_of(what.first)
        case Dataset():
            frf = Frf(what.f, what.H, what.channels, "Va", np.full(what.H.shape, np.nan), what.cov, what.nu, (), "")
            return Plot(bode(frf, {c: RESPONSE_UNITS[c] for c in what.channels if c in RESPONSE_UNITS}), what.name)
        case Fit() | Calibration():
            fit = what if isinstance(what, Fit) else what.fit
            data = fit.datasets[0]
            after = data.H - fit.residuals[0]
            return Plot(dict(fit_panels(data.around(after), after, after)), data.name)
        case Mapping() if what and all(isinstance(each, Panel) for each in what.values()):
            return Plot(what)
        case _:
            words = "a result, response, model, dataset, fit, misalignment, gap analysis or panels"
            raise PictureError(f"{type(what).__name__} has no picture; expected {words}")


def _loaded_unit(unit: UnitLike) -> LoadedUnit:
    if not isinstance(unit, str | Path | LoadedUnit):
        raise ArgumentError(f"a unit is its folder or what read_unit returned, not a {type(unit).__name__}")
    return loaded(Path(unit) if isinstance(unit, str) else unit)


def _file(file: str | Path) -> Path:
    if not isinstance(file, str | Path):
        raise ArgumentError(f"a file or folder is named by a text or a Path, not by a {type(file).__name__}")
    return Path(file)
