"""`accept report`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.base.atomic_files import check_place
from accept.base.console import ask, confirm, say
from accept.base.exit_codes import of_verdicts
from accept.base.home import home
from accept.base.progress import busy
from accept.batch.pipeline import Pipeline, ReasonError, spec_for
from accept.batch.services import JudgingServices
from accept.batch.table import reasons
from accept.commands.answer import Answer, Remark, command
from accept.commands.trust.bench_keys import bench_credential, who_acts
from accept.commands.units.batch import specs_for
from accept.commands.units.options import ReportOptions
from accept.gap import one_line
from accept.store import open_store
from accept.units import unit_folder
from specs.bench import load_bench


@command
def run(unit: Annotated[Path, typer.Argument(help="Unit folder.")], wanted: ReportOptions) -> Answer:
    """Judge one unit and write its signed certificate."""
    check_place(wanted.out, ".pdf")
    folder = unit_folder.read(unit)
    if wanted.model is not None:
        from accept.models.model_file import open_model

        open_model(wanted.model)  # the one that is named, unlike a spec's, must be there
    chosen = spec_for(folder, specs_for(wanted.spec))
    bench_file = load_bench(wanted.bench) if wanted.bench else None
    credential = bench_credential(home(), wanted.operator, wanted.tsa)
    who = credential.person if credential else who_acts(wanted.operator)
    with open_store() as store:
        pipeline = Pipeline(
            store,
            {folder.kind: chosen},
            who,
            JudgingServices(store, who, credential, wanted.model),
            bench_file=bench_file,
            confirm=confirm,
            reason=wanted.reason,
            ask_reason=ask,
        )
        job = pipeline.prepare(folder, pipeline.ask(folder), wanted.out)
        with busy(f"{folder.serial}: judging and signing"):
            settled = pipeline.settle(job, job.judge(say))
    result = settled.result
    weakened = f"was judged with a recording of {folder.serial}; its result is invalid; judge it again"
    written = "" if settled.unsigned else f"; {'certificate' if credential else 'unsigned report'} in {wanted.out}"
    return Answer(
        *(Remark(f"warning: {other} {weakened}") for other in settled.weakened),
        Remark("" if result.action is None else f"{result.serial}: what to do: {result.action}"),
        *map(Remark, reasons([result])),
        Remark("" if result.gap is None else f"{result.serial}: {one_line(result.gap)}"),
        Remark(f"{result.serial}: {result.marked_word}{written}"),
        exit=of_verdicts([str(result.verdict)]),
        error=ReasonError(settled.unsigned) if settled.unsigned else None,
    )
