"""The gap workflow on a unit folder: records in; gap.json, gap.pdf and the improved model out, here or in a worker."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.base.console import say
from accept.base.worker_process import too_large
from accept.gap.document import to_json
from accept.gap.improved_model import AddedElement, write_improved, write_with_elements
from accept.gap.report import summary
from accept.gap.text import words_of
from accept.gap.unit_responses import SEARCH_LO, Responses, channels_of, realisations, responses, trials_of
from accept.models.model_file import OpenedModel, as_weighed, open_model_file
from accept.units import RESPONSES, LoadedUnit, UnitError, UnitFolder, loaded
from checks.errors import ModelError, RecordError
from checks.fitting import CHANNELS, F_HI, Dataset, Identifiability, LikelihoodProfile
from checks.gap import EFFECTS, GapRefused, Inputs, Result, effect_named, run
from checks.model import Model
from checks.record import Record
from checks.signals import disturbance_notes
from specs.plugins import product_named

Say = Callable[[str], None]
SLOW_SINES = "hysteresis"  # section of unit.toml with the record of slow sines
FEWER = (("Vs", "da"), ("de", "da"), ("Vs", "de"), ("da",), ("de",))  # channels to go on with
NOISE_ALONE = 1.0  # relative noise from which on a bin says nothing


@dataclass(frozen=True, eq=False)
class GapAnalysis:
    """The answer of the workflow with its inputs."""

    result: Result
    measured: Responses
    model: OpenedModel
    inputs: Inputs

    def __repr__(self) -> str:
        return "\n".join(summary(self.measured.serial, self.result))

    @property
    def identifiability(self) -> dict[str, Identifiability]:
        """Return how well the responses determine each named value beside all others that were fitted, by
        `effect.parameter`. Names found without a fit (signs, slow sines) have no entry."""
        return Identifiability.of_effects(self.result.fit, [n.effect for n in self.result.named])

    def profile(self, name: str) -> LikelihoodProfile:
        """Return the profile of the likelihood of a fitted value, such as "misalignment.dy_um": a fit for each of seven
        values about it, on all that was fitted: unnamed effects and experiments too. Raises ModelError for a name that
        was not fitted."""
        return LikelihoodProfile.of(self.result.fit, name)

    @property
    def document(self) -> dict[str, Any]:
        return to_json(self.measured.serial, self.result)


def run_gap(
    folder: Path,
    model: str | Path,
    out: Path | None = None,
    without: Sequence[str] = (),
    say: Say = lambda _: None,
) -> dict[str, Any]:
    """Return gap.json of a unit as a dictionary and, with out, write the files there. without: effects that are removed
    from the library. Raises UnitError, RecordError, SpecError, ModelError, GapRefused."""
    done = analyse(folder, model, without, say)
    if out is not None:
        write(done, out)
    return done.document


def analyse(
    unit: Path | UnitFolder | LoadedUnit,
    model: str | Path,
    without: Sequence[str] = (),
    say: Say = lambda _: None,
) -> GapAnalysis:
    """Run the workflow on a unit."""
    for name in without:
        effect_named(name)  # raises ModelError: a name that is mistyped would leave nothing out
    held = loaded(unit)
    given = open_model_file(model)
    say("reading the records")
    measured, notes = _read_responses(held, given.model)
    for words in measured.remarks:
        say(words)
    given = as_weighed(given, measured.serial, measured.payload_kg, measured.payload_U_kg)
    A, B, more = realisations(measured, given.model.tolerance)
    trials, lost = trials_of(held, measured, given.model.tolerance)
    bench = given.model.learned
    A, B = A.on_bench(bench), B.on_bench(bench)
    trials = tuple(replace(t, A=t.A.on_bench(bench), B=t.B.on_bench(bench)) for t in trials)
    low = measured.records["low"]
    inputs = Inputs(
        model=given.model,
        A=A,
        B=B,
        fs=low.fs,
        merge_Hz=measured.merge_Hz,
        slow=_slow(held),
        without=frozenset(without),
        notes=(*notes, *more, *_quality(A), *disturbance_notes(low), *measured.first.notes, *lost),
        trials=trials,
    )
    return GapAnalysis(run(inputs, say), measured, given, inputs)


def write(done: GapAnalysis, out: Path, empirical: bool = False, html: bool = False) -> tuple[AddedElement, ...]:
    """Write gap.json, gap.pdf and model.toml into a folder and return the elements added without a name. empirical: add
    these to the model; html: write gap.html as well. Raises PictureError if plotly is not installed."""
    from accept.gap.report_pdf import render  # loads reportlab and matplotlib: only when wanted

    model = out / "model.toml"
    added: tuple[AddedElement, ...] = ()
    if empirical:
        added = write_with_elements(model, done.model, done.measured, done.result, done.inputs)
    else:
        write_improved(model, done.model, done.measured, done.result)
    document = done.document | ({"empirical": [a.document for a in added]} if empirical else {})
    write_atomic(out / "gap.json", json.dumps(document, indent=1, allow_nan=False).encode())
    write_atomic(out / "gap.pdf", render(done.measured.serial, done.result, added))
    if html:
        from accept.gap.report import render_html

        write_atomic(out / "gap.html", render_html(done.measured.serial, done.result, added))
    return added


def _read_responses(unit: LoadedUnit, model: Model) -> tuple[Responses, tuple[str, ...]]:
    """Return the responses of the available channels, up to the model's highest frequency, and notes on missing
    channels. Raises ModelError if the model has a channel that units of this product do not have."""
    tolerance, f_hi = model.tolerance, min(F_HI, model.up_to_Hz)
    notes = () if f_hi == F_HI else (f"compared to {f_hi:.0f} Hz only: {model.name} is valid up to there",)
    product, has = product_named(unit.folder.kind), channels_of(unit.folder.kind)
    if other := [c for c in model.channels if c in product.absent]:
        why = f"{', '.join(other)}; {product.absent[other[0]]}; the model of its kind is {product.model}"
        raise ModelError(f"model '{model.name}' has {why}")
    if len(has) < len(CHANNELS):
        notes = (*(_unseen(c, product.absent[c]) for c in CHANNELS if c in product.absent), *notes)
    if (asked := unit.unexpected_channel(RESPONSES)) is not None:
        notes = (f"{asked} It is not used", *notes)
    try:
        return responses(unit, tolerance, f_lo=SEARCH_LO, f_hi=f_hi), notes
    except RecordError as e:
        first = e
    for kept in (kept for kept in FEWER if set(kept) < set(has)):
        try:
            found = responses(unit, tolerance, channels=kept, f_lo=SEARCH_LO, f_hi=f_hi)
        except RecordError:
            continue
        lost = ", ".join(c for c in has if c not in kept)
        words = f"without {lost} ({first}): what shows only there cannot be found, and power is lost elsewhere"
        return found, (*notes, words)
    raise first


def _unseen(channel: str, why: str) -> str:
    """Return the note on a channel that units of this product do not have, with the effects that are named by it."""
    lost = ", ".join(words_of(e.name) for e in EFFECTS.values() if e.is_lost_without(channel))
    return f"{why}; without {channel} these effects cannot be named: {lost}"


def _quality(A: Dataset) -> tuple[str, ...]:
    """Return the notes on channels that are of little use. Raises GapRefused if no channel is usable."""
    poor = {c: float((A.noise[:, i] > NOISE_ALONE * abs(A.H[:, i]) ** 2).mean()) for i, c in enumerate(A.channels)}
    if min(poor.values()) > 0.5:
        raise GapRefused("no channel follows the drive in half of the band: coherence is too low to say anything")
    return tuple(f"{c} hardly follows the drive in {100 * p:.0f} % of the bins" for c, p in poor.items() if p > 0.5)


def _slow(unit: LoadedUnit) -> Record | None:
    if SLOW_SINES not in unit.folder.sections:
        return None
    try:
        record = unit.values(SLOW_SINES).get("record")
    except RecordError:
        return None
    return record if isinstance(record, Record) else None


@dataclass(frozen=True, eq=False)
class GapAnswer:
    """gap.json, and lines for a person."""

    document: Mapping[str, Any]
    words: Sequence[str]


@dataclass(frozen=True)
class GapJob:
    """The gap analysis of a unit; its files go into `out`."""

    unit: UnitFolder
    out: Path
    model: str
    without: tuple[str, ...] = ()
    empirical: bool = False
    html: bool = False

    def run(self) -> GapAnswer | str:
        serial = self.unit.serial
        try:
            done = analyse(self.unit, self.model, self.without, lambda words: say(f"{serial}: {words}"))
        except (GapRefused, ModelError, RecordError, UnitError) as e:
            return str(e)
        except MemoryError:
            return too_large()
        added = write(done, self.out, self.empirical, self.html)
        return GapAnswer(done.document, summary(serial, done.result, added))
