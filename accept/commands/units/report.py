"""`accept report`."""

from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from accept.base.atomic_files import check_place
from accept.base.console import clear_errors, operator_name, say
from accept.base.exit_codes import Exit, of_verdicts
from accept.base.home import home
from accept.base.progress import busy
from accept.batch.request import spec_for
from accept.batch.table import reasons_of
from accept.certificate import uncertified
from accept.certificate.certify import certify
from accept.certificate.examine import JudgedUnit, examine
from accept.certificate.trust.commissioning import bench_statement
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.provenance import provenance
from accept.commands.trust.bench_keys import bench_credential
from accept.commands.units.batch import specs_for
from accept.commands.units.options import ReportOptions
from accept.gap.start_model import StartModel
from accept.gap.text import one_line
from accept.judging.copies import copies_of, withhold_others
from accept.judging.parts import part_doubts
from accept.store import Store, UnitState, fold, open_store
from accept.store.spelling import mistaken_for
from accept.units import unit_folder
from specs.bench import load_bench


@clear_errors
def run(unit: Annotated[Path, typer.Argument(help="Unit folder.")], wanted: ReportOptions) -> Exit:
    """Judge one unit and write its signed certificate."""
    check_place(wanted.out)
    one = unit_folder.read(unit)
    if wanted.model is not None:
        from accept.models.model_file import open_model

        open_model(wanted.model)  # the one that is named, unlike a spec's, must be there
    chosen = spec_for(one, specs_for(wanted.spec))
    today = datetime.now(UTC).date()
    stated = bench_statement(load_bench(wanted.bench), chosen.checks, today, home()) if wanted.bench else None
    credential = bench_credential(home(), wanted.operator, wanted.tsa)
    who = credential.person if credential else operator_name(wanted.operator)
    with open_store() as store:
        if (known := store.other_spelling(one.serial)) is not None:
            raise unit_folder.UnitError(unit / unit_folder.UNIT_FILE, [mistaken_for(one.serial, known)])
        past = list(store.events(one.serial))
        last = fold(past).units.get(one.serial)
        due = last if credential and last and uncertified.is_due(last, one, chosen, who) else None
        start = StartModel.of(chosen, wanted.model)
        examined = partial(examine, one, chosen, who, stated=stated, start=start, say=say)
        with busy(f"{one.serial}: judging and signing"):
            judged = _judged(store, examined, uncertified.before(past, due) if due else last, credential)
            if due and not uncertified.repeats(store, one.serial, due.seq, judged.result):
                due, judged = None, _judged(store, examined, last, credential)
            certify(judged, store, wanted.out, credential, stored=due is not None)
        for other in withhold_others(store, one.serial, judged.result.copies, who):
            say(f"warning: {other} was judged with a recording of {one.serial}; its result counts no more")
    result = judged.result
    for line in reasons_of(result):
        say(line)
    if result.gap is not None:
        say(f"{result.serial}: {one_line(result.gap)}")
    say(f"{result.serial}: {result.verdict}; {'certificate' if credential else 'unsigned report'} in {wanted.out}")
    return of_verdicts([str(result.verdict)])


def _judged(
    store: Store, examined: "partial[JudgedUnit]", before: UnitState | None, credential: Credential | None
) -> JudgedUnit:
    """The unit as an attempt that follows `before`, drawn again where its recordings stand elsewhere too or
    something speaks against its parts."""
    unit, spec = examined.args[:2]
    stated = provenance(spec, before, store.signed_head(), home(), credential)
    judged = examined(provenance=stated)
    copies = copies_of(store, unit.serial, str(unit.path.resolve()), judged.result.samples)
    doubts = part_doubts(store, unit.serial, unit.parts)
    return examined(provenance=stated, copies=copies, doubts=doubts) if copies or doubts else judged
