"""`accept report`."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept import units
from accept.base.atomic_files import check_place
from accept.base.console import ask, confirm, say
from accept.base.exit_codes import of_verdicts
from accept.base.progress import busy
from accept.batch.pipeline import Pipeline, ReasonError
from accept.batch.services import JudgingServices
from accept.batch.table import reasons
from accept.commands.answer import Answer, Remark, command
from accept.commands.options import SpecName
from accept.commands.units.batch import signer, specs_for
from accept.commands.units.options import JudgingOptions
from accept.gap import one_line
from accept.judging import spec_for
from accept.store import open_store
from specs.bench import load_bench


@command
def run(
    unit: Annotated[Path, Argument(help="Unit folder.")],
    out: Annotated[Path, Option(help="The certificate to write.")],
    spec: SpecName = None,
    *,
    how: JudgingOptions,
) -> Answer:
    """Judge one unit and write its signed certificate."""
    check_place(out, ".pdf")
    folder = units.read(unit)
    chosen = spec_for(folder, specs_for(spec))
    bench_file = load_bench(how.bench) if how.bench else None
    credential, who = signer(how)
    with open_store() as store:
        pipeline = Pipeline(
            store, {folder.kind: chosen}, who, JudgingServices(store, who, credential, how.model),
            bench_file=bench_file, confirm=confirm, reason=how.reason, ask_reason=ask,
        )  # fmt: skip
        job = pipeline.prepare(folder, pipeline.ask(folder), out)
        with busy(f"{folder.serial}: judging and signing"):
            settled = pipeline.settle(job, job.judge(say))
    result = settled.result
    weakened = f"was judged with a recording of {folder.serial}; its result is invalid; judge it again"
    written = "" if settled.unsigned else f"; {'certificate' if credential else 'unsigned report'} in {out}"
    return Answer(
        *(Remark(f"warning: {other} {weakened}") for other in settled.weakened),
        Remark("" if result.action is None else f"{result.serial}: what to do: {result.action}"),
        *map(Remark, reasons([result])),
        Remark("" if result.gap is None else f"{result.serial}: {one_line(result.gap)}"),
        Remark(f"{result.serial}: {result.marked_word}{written}"),
        exit=of_verdicts([str(result.verdict)]),
        error=ReasonError(settled.unsigned) if settled.unsigned else None,
    )
