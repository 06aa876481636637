"""A batch of units: the model learned from them, the bench that all share, and the units that do not belong.

    units = [UnitOfBatch(serial, model, responses) for serial, responses in measured.items()]
    found = Population.of_units(units, model, say=print, steps=lambda items, words: items)
    found.batch.mean, found.batch.scatter  # by found.names
    found.bench  # the factor that the bench puts on every unit, as `checks.model.LearnedBench`
    [(one.serial, one.reason) for one in found.judged if not one.belongs]

Each unit is judged by the prediction of the others."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.population.learn import FEWEST, BatchMember, NothingLearned, Population
    from checks.population.unit_fits import UnitOfBatch
else:
    __getattr__ = door(__name__)
