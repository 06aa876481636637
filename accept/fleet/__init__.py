"""Questions over many units, benches and months: history, yield, trends, golden units, sets that fit together, and the
model that is learned from a batch.

    keep_findings(store)  # after many judgements: the next question reads columns, not every event

    found = learn(measured, given, say=print)  # `measured_units(folders, given)` reads them; given: an `OpenedModel`
    lines(found)  # the batch and its bench in words
    shifts(found, most=3)  # the parameters that moved the most
    write_population(path, found)  # batch and bench as a model file

The questions are the commands in `accept.commands.fleet`: they alone read the files behind this door."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.fleet.findings_file import keep_findings
    from accept.fleet.golden import BenchStopped, check_may_judge, goldens, missed, not_counted
    from accept.fleet.matched_sets import serials_in
    from accept.fleet.population.learn import learn, measured_units
    from accept.fleet.population.report import lines, shifts, write_population
else:
    __getattr__ = door(__name__)
