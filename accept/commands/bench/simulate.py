"""`accept simulate unit` and `accept simulate faults`."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from rich.box import SIMPLE_HEAD
from typer import Option

from accept.base.documents.listings import FaultList, FaultListed
from accept.base.progress import busy
from accept.commands.answer import Answer, File, Remark, command, refusal, table
from accept.commands.options import JsonAnswer
from accept.models.model_file import SIMULATED_MODEL, effects_of, open_model_file
from accept.simulate import FAULTS, UnitRequest, UnitRequestError, simulate, write
from accept.simulate.converters import Converters
from accept.simulate.faults import UnitFault
from accept.simulate.unit_request import ExperimentRequest, drawn, on_bench
from checks.model import Model
from checks.signals import ExcitationError

Effect = tuple[str, dict[str, float]]


@dataclass(frozen=True)
class SimulateOptions:
    """One unit to simulate. effect, experiment, setting: None for none, as typer has lists that may be left out."""

    out: Annotated[Path, Option(help="The unit folder to write.")]
    kind: Annotated[str, Option(help=f"One of {', '.join(SIMULATED_MODEL)}.")] = "strut"
    model: Annotated[str | None, Option(help="Built-in model or TOML file; default: by the kind.")] = None
    serial: Annotated[str | None, Option(help="Serial; else SIM with kind and seed.")] = None
    seed: Annotated[int, Option(min=0, help="Seed; equal seeds give equal bytes.")] = 0
    dx_um: Annotated[float, Option("--dx-um", help="Misalignment along x [um].")] = 0.0
    dy_um: Annotated[float, Option("--dy-um", help="Misalignment along y [um].")] = 0.0
    effect: Annotated[
        list[str] | None, Option(help="For example bench_mode:f_Hz=110,ratio=0.03,damping_ratio=0.01")
    ] = None
    experiment: Annotated[list[str] | None, Option(help="More responses, such as added_mass:mass_kg=0.5")] = None
    setting: Annotated[list[str] | None, Option("--set", help="A parameter, such as joint.kz_N_per_um=80")] = None
    draw: Annotated[bool, Option("--draw", help="Draw every uncertain parameter from its prior.")] = False
    fault: Annotated[str | None, Option(help="What is wrong with it: see `accept simulate faults`.")] = None
    noise: Annotated[float, Option(min=0.0, help="Factor on the usual noise of the sensors.")] = 1.0
    ideal: Annotated[bool, Option("--ideal", help="Converters without steps and ranges.")] = False
    hold: Annotated[bool, Option("--hold", help="Converter that holds each sample, without a filter.")] = False
    low_s: Annotated[float, Option("--low-s", help="Length of the low record [s].")] = 20.0
    high_s: Annotated[float, Option("--high-s", help="Length of the high record [s].")] = 20.0
    repeats: Annotated[bool, Option("--repeats/--no-repeats", help="A second realisation of both.")] = True


@command
def unit(wanted: SimulateOptions) -> Answer:
    """Simulate a whole unit folder from a model. With the truth beside it in truth.json."""
    try:
        request = request_of(wanted)
        with busy(f"{request.serial}: simulating its records"):
            folder = write(simulate(request), wanted.out)
    except (UnitRequestError, ExcitationError) as e:
        return refusal(e)
    hidden = [name for name, _ in request.effects] + ([f"fault {request.fault}"] if request.fault else [])
    words = ", ".join(hidden) or "as it should be"
    made = Remark(f"{request.serial}: a simulated {request.kind} of model '{request.model.name}' ({words})")
    return Answer(made, Remark("the true values are in truth.json"), str(folder))


@command
def faults(json: JsonAnswer = None) -> Answer:
    """List what can be wrong with a simulated unit. And what the bench then says."""
    listed = [
        FaultListed(name, tuple(f.kinds), f.words, tuple((q, v) for q, v in f.shows)) for name, f in FAULTS.items()
    ]
    rows = ((name, ", ".join(fault.kinds), fault.words, _judgement(fault)) for name, fault in FAULTS.items())
    titles = ("fault", "kind", "what is wrong", "what a judgement shows")
    return Answer(File(json, FaultList(tuple(listed))), table(titles, rows, box=SIMPLE_HEAD, pad_edge=False))


def _judgement(fault: UnitFault) -> str:
    shows = _shown(fault.shows)
    if fault.unexplained:
        shows += f"; strut: {_shown(fault.unexplained)}, no result with the gap analysis"
    return shows


def _shown(shows: Iterable[tuple[str, str]]) -> str:
    return ", ".join(f"{quantity} {verdict.replace('_', ' ')}" for quantity, verdict in shows)


def request_of(wanted: SimulateOptions) -> UnitRequest:
    """Return the request of a command line. Raises UnitRequestError, SpecError or ModelError."""
    if wanted.kind not in SIMULATED_MODEL:
        raise UnitRequestError(f"kind '{wanted.kind}': expected one of {', '.join(SIMULATED_MODEL)}")
    model, effects = _model(wanted)
    effects += [named_values(text, "effect") for text in wanted.effect or ()]
    if wanted.dx_um or wanted.dy_um:
        effects.append(("misalignment", {"dx_um": wanted.dx_um, "dy_um": wanted.dy_um}))
    return UnitRequest(
        serial=wanted.serial or f"SIM-{wanted.kind.upper()}-{wanted.seed}",
        kind=wanted.kind,
        model=model,
        seed=wanted.seed,
        effects=tuple(effects),
        fault=wanted.fault,
        converters=Converters(ideal=wanted.ideal).noisier(wanted.noise),
        hold=wanted.hold,
        repeats=wanted.repeats,
        low_s=wanted.low_s,
        high_s=wanted.high_s,
        experiments=tuple(experiment_of(text) for text in wanted.experiment or ()),
    )


def _model(wanted: SimulateOptions) -> tuple[Model, list[Effect]]:
    """Return the model before any effect is added, and the effects of its file that are not among its parameters."""
    it = open_model_file(wanted.model or SIMULATED_MODEL[wanted.kind])
    model = it.model
    model = on_bench(model, wanted.kind) if wanted.model is None else model
    model = drawn(model, wanted.seed) if wanted.draw else model
    model = model.with_values(pairs(wanted.setting or (), "--set"))
    return model, [effect for effect in effects_of(it.spec) if effect[0] in it.left_out]


def named_values(text: str, what: str) -> Effect:
    """Parse `name:key=value,key=value`, or a name without values. Raises UnitRequestError."""
    name, _, given = text.partition(":")
    return name.strip(), pairs((p for p in given.split(",") if p.strip()), f"{what} '{name}'")


def experiment_of(text: str) -> ExperimentRequest:
    """Parse `kind:key=value`, or a kind without values. Raises UnitRequestError."""
    return ExperimentRequest.of(*named_values(text, "experiment"))


def pairs(texts: Iterable[str], where: str) -> dict[str, float]:
    """Parse texts of the form `key=value`. Raises UnitRequestError."""
    out: dict[str, float] = {}
    for text in texts:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or key in out:
            raise UnitRequestError(f"{where}: '{text}': expected key=value, each key once")
        try:
            out[key] = float(value)
        except ValueError as e:
            raise UnitRequestError(f"{where}: {key} = '{value}': expected a number") from e
    return out
