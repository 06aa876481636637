"""A batch of units on disk, and the model that is learned from it (`checks.population`)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import tomlkit

from accept.base.progress import steps
from accept.gap import Responses, responses
from accept.models.model_file import OpenedModel, as_weighed, model_of_spec
from accept.units import UnitError
from checks.errors import ModelError
from checks.population import FEWEST, Population, UnitOfBatch
from specs.model import parse_model
from specs.model_sections import ApaOfModes

SAME = 1e-6  # relative: a copy in single precision stays below it, a repeat of the recording does not


@dataclass(frozen=True, eq=False)
class LearnedPopulation(Population):
    """A population with the model file that it began with. inputs: serial -> file name -> sha256."""

    given: OpenedModel
    inputs: Mapping[str, Mapping[str, str]]


def with_scatter(given: OpenedModel, say: Callable[[str], None]) -> OpenedModel:
    """Return a model whose modes scatter as those of any APA, if its file takes every APA for the same: the batch shows
    by how much. Raises SpecError, ModelError."""
    if not isinstance(given.spec.apa, ApaOfModes) or given.spec.apa.mode_scatter is not None:
        return given
    say("no batch by a model file without [apa] mode_scatter: that of the units is learned, from 1 % in frequency on")
    document = tomlkit.parse(given.spec.text)
    scatter = document["apa"]["mode_scatter"] = tomlkit.inline_table()
    scatter.update({"frequency": 0.01, "damping": 0.20})
    return model_of_spec(parse_model(tomlkit.dumps(document).encode(), given.spec.name, Path(given.spec.folder)))


def measured_units(folders: Sequence[Path], given: OpenedModel) -> list[Responses]:
    """Return the responses of every unit; nothing is fitted before all can be read. Raises UnitError, RecordError,
    ModelError."""
    if len(folders) < FEWEST:
        raise ModelError(f"{len(folders)} units: a batch needs {FEWEST} or more")
    found = [responses(folder, given.model.tolerance, given.model.channels) for folder in folders]
    serials = [m.serial for m in found]
    for folder, serial in zip(folders, serials, strict=True):
        if serials.count(serial) > 1:
            raise UnitError(folder, [f"serial '{serial}' is given twice; each unit counts once"])
    for (one, measured), (other, copied) in combinations(zip(folders, found, strict=True), 2):
        H, other_H = measured.first.H, copied.first.H
        # By whatever serial: noise alone makes any two recordings differ by more.
        if H.shape == other_H.shape and np.allclose(H, other_H, rtol=SAME, atol=0.0):
            raise UnitError(other, [f"holds the recording of {measured.serial} ({one}); each unit counts once"])
    for folder, measured in zip(folders, found, strict=True):
        alone = np.abs(measured.first.H) ** 2 < measured.first.noise
        if alone.mean(axis=0).min() > 0.5:
            raise UnitError(folder, ["no channel follows the drive in half of the band: its records say nothing"])
    kinds = {m.kind for m in found}
    if len(kinds) > 1:
        raise ModelError(f"units of kinds {', '.join(sorted(kinds))}: a batch is of one kind")
    return found


def learn(measured: Sequence[Responses], given: OpenedModel, say: Callable[[str], None]) -> LearnedPopulation:
    """Learn bench and batch from units; if they are no batch by a model that takes every APA for the same, by one whose
    modes scatter. Raises ModelError, NothingLearned."""
    found = _learned(measured, given, say)
    other = given if found.holds else with_scatter(given, say)
    return found if other is given else _learned(measured, other, say)


def _learned(measured: Sequence[Responses], given: OpenedModel, say: Callable[[str], None]) -> LearnedPopulation:
    units = [
        UnitOfBatch(m.serial, as_weighed(given, m.serial, m.payload_kg).model, m.first, m.second, m.payload_kg)
        for m in measured
    ]
    found = Population.of_units(units, given.model, say, steps)
    return LearnedPopulation(**vars(found), given=given, inputs={m.serial: m.inputs for m in measured})
