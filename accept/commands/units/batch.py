"""`accept batch`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from accept.base.cluster.connect import connected
from accept.base.console import ask, confirm, say
from accept.base.home import home
from accept.batch import judge_batch
from accept.batch.judge_batch import BatchReport, BatchRequest
from accept.batch.table import actions, explanations, reasons, simulated, units_table
from accept.commands.answer import Answer, Remark, command
from accept.commands.trust.bench_keys import bench_credential, who_acts
from accept.commands.units.options import BatchOptions
from accept.judging.judge_unit import default_specs, load_spec
from accept.store import open_store
from accept.units.remote_folders import fetched
from specs.bench import load_bench
from specs.errors import AcceptError
from specs.files import json_of, read_bounded
from specs.spec import Spec


@command
def run(
    units: Annotated[
        list[str], typer.Argument(help="Unit folders, folders that contain them, or their addresses (s3://...).")
    ],
    wanted: BatchOptions,
) -> Answer:
    """Judge unit folders. Writes results.json, results.csv, junit.xml, certificates; judges only what changed."""
    if wanted.model is not None:
        from accept.models.model_file import open_model

        open_model(wanted.model)  # the one that is named, unlike a spec's, must be there
    credential = None if wanted.no_certificates else bench_credential(home(), wanted.operator, wanted.tsa)
    who = credential.person if credential else who_acts(wanted.operator)
    paths, refused = fetched(units, wanted.out, say)
    with connected(wanted.cluster, say) as cluster, open_store() as store:
        request = BatchRequest(
            paths,
            wanted.out,
            specs_for(wanted.spec),
            who,
            credential,
            wanted.workers,
            bench=load_bench(wanted.bench) if wanted.bench else None,
            model=wanted.model,
            cluster=cluster,
            refused=refused,
            confirm=confirm,
            reason=wanted.reason,
            ask_reason=ask,
        )
        listed = _earlier_serials(wanted.out)
        report = judge_batch.run(request, store, say)
    unchanged = f"{report.unchanged} of {report.judged} units unchanged since they were judged: not judged again"
    gone = sorted(listed - {u.serial for u in report.units}) if report.units else []
    left_out = f"results.* no longer list {', '.join(gone)}: not asked for this time; `accept list` has them all"
    certificates = f", {wanted.out / 'certificates'}" if credential else ""
    return Answer(
        *_lines(report),
        Remark(unchanged if report.unchanged else ""),
        Remark(left_out if gone else ""),
        Remark(f"results: {wanted.out / 'results.json'}, results.csv, junit.xml{certificates}"),
        exit=report.exit(),
    )


def _lines(report: BatchReport) -> Iterator[str | Table]:
    """Yield the table of the units and lines about them, or the number of each verdict if no units are listed."""
    if report.units:
        yield units_table(report.units)
        for lines in (simulated, actions, reasons, explanations):
            yield from lines(report.units)
    else:  # too many for a table, or none
        yield from (f"{count} {verdict}" for verdict, count in sorted(report.verdicts.items()))


def _earlier_serials(out: Path) -> set[str]:
    """Return the serials in the results of an earlier batch."""
    try:
        return {str(unit["serial"]) for unit in json_of(read_bounded(out / "results.json"))["units"]}
    except (AcceptError, OSError, ValueError, KeyError, TypeError):
        return set()


def specs_for(name: str | None) -> dict[str, Spec]:
    """Return kind -> spec: the one named, or that of every installed product."""
    chosen = [load_spec(name)] if name else default_specs()
    return {spec.kind: spec for spec in chosen}
