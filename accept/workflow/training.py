"""Training: a simulated unit with a hidden fault, on simulated instruments, in a folder apart from the real bench."""

import random
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.base.home import home
from accept.judging.judge_unit import DEFAULT_SPEC, load_spec
from accept.models.model_file import SIMULATED_MODEL, open_model
from accept.pictures.labels import label_of
from accept.simulate import FAULTS, UnitRequest, simulate
from accept.simulate.bench_truth import world_of
from accept.simulate.unit_request import SHORT_S, drawn, on_bench
from accept.store import open_store
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE, UnitFolder
from accept.workflow.bench import LOCK_WAIT_S, Workbench
from accept.workflow.instruments.hardware import BenchInstruments
from accept.workflow.instruments.port import InstrumentPort
from accept.workflow.steps.plan import is_needed
from hw.simulated import SimulatedBench
from specs.bench import load_bench

BYTE_S = 0.0005  # about 19200 baud


@dataclass(frozen=True)
class Label:
    """A value on a label or a scale beside the bench, such as the added mass."""

    name: str
    value: float
    unit: str

    def read(self) -> tuple[float, str]:
        return self.value, self.unit

    def uncertainty(self, _: float) -> float | None:
        return None

    def evidence(self) -> Mapping[str, Any]:
        return {}


class TrainingInstruments(BenchInstruments):
    """The simulated instruments, and the labels for inputs without an instrument."""

    def __init__(self, bench_file: Path, taught: UnitFolder) -> None:
        super().__init__(load_bench(bench_file))
        self._taught = taught

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:
        found = super().serving(check, name, index)
        section = self._taught.sections.get(check)
        labelled = section.number(name) if section else None
        if found is None and section is not None and labelled is not None:
            declared = section.declared.inputs[name]
            return Label("the label", labelled, str(getattr(declared, "unit", "1"))) if is_needed(declared) else None
        return found


def open_training(spec: str | None, seed: int | None) -> Workbench:
    """Return a bench with one new unit, its records in a folder, its instruments on pseudo-terminals. Raises what
    `open_bench` does, UnitRequestError, ModelError."""
    chosen = load_spec(spec or DEFAULT_SPEC["apa"])
    place = home() / "training"
    seed = random.SystemRandom().randrange(10**6) if seed is None else seed
    serial = f"TRAIN-{seed:06d}"
    request, hidden = training_request(chosen.kind, serial, seed)
    made = simulate(request)
    records = place / "records" / serial
    for name, content in made.files.items():
        write_atomic(records / name, content)
    taught = unit_folder.read(records)
    running = ExitStack()
    bench = running.enter_context(SimulatedBench(world_of(records), place / "bench" / serial, seed=seed, byte_s=BYTE_S))
    (records / UNIT_FILE).unlink()  # the technician finds records, not their list
    instruments = TrainingInstruments(bench.bench_file, taught)
    running.callback(instruments.close)
    store = open_store(f"sqlite:///{place / 'store.sqlite'}", timeout_s=LOCK_WAIT_S, bench=place)
    return Workbench(
        store, place, {chosen.kind: chosen}, instruments, records, hidden=hidden, proposed=serial, closing=running.close
    )


def training_request(kind: str, serial: str, seed: int) -> tuple[UnitRequest, str]:
    """Return a unit with one of the faults that its kind can have, or with none, and the words that describe it."""
    rng = random.Random(seed)
    possible = [None, *(name for name, fault in FAULTS.items() if kind in fault.kinds)]
    fault = rng.choice(possible)
    model = on_bench(drawn(open_model(SIMULATED_MODEL[kind]), seed), kind)
    request = UnitRequest(serial, kind, model, seed=seed, fault=fault, repeats=False, low_s=SHORT_S, high_s=SHORT_S)
    return request, hidden_words(fault, kind)


def hidden_words(fault: str | None, kind: str) -> str:
    """Return the hidden fault of a unit of a kind, and which findings had to show it before any gap analysis."""
    if fault is None:
        return "Nothing was wrong with this unit: every finding had to pass."
    hidden = FAULTS[fault]
    before, after = hidden.shown(kind), hidden.shows
    explained = f" After the gap analysis: {_said(after)}." if after != before else ""
    return f"Hidden in this unit: {hidden.words}.\nIt had to show as {_said(before)}.{explained}"


def _said(shows: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f"{label_of(quantity)}: {verdict.replace('_', ' ')}" for quantity, verdict in shows)
