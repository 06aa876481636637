"""`accept batch`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from accept.base.cluster.connect import connected
from accept.base.console import ask, clear_errors, confirm, say, stdout, tell
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.batch import judge_batch
from accept.batch.judge_batch import BatchRequest
from accept.batch.table import actions, explanations, reasons, simulated, units_table
from accept.commands.trust.bench_keys import bench_credential, who_acts
from accept.commands.units.options import BatchOptions
from accept.judging.judge_unit import default_specs, load_spec
from accept.store import open_store
from accept.units.remote_folders import fetched
from specs.bench import load_bench
from specs.errors import AcceptError
from specs.files import read_bounded
from specs.spec import Spec


@clear_errors
def run(
    units: Annotated[
        list[str], typer.Argument(help="Unit folders, folders that contain them, or their addresses (s3://...).")
    ],
    wanted: BatchOptions,
) -> Exit:
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
    if report.units:
        stdout.print(units_table(report.units))
        for lines in (simulated, actions, reasons, explanations):
            for line in lines(report.units):
                tell(line)
    else:  # too many for a table, or none
        for verdict, count in sorted(report.verdicts.items()):
            tell(f"{count} {verdict}")
    if report.unchanged:
        say(f"{report.unchanged} of {report.judged} units unchanged since they were judged: not judged again")
    gone = sorted(listed - {u["serial"] for u in report.units}) if report.units else []
    if gone:
        say(f"results.* no longer list {', '.join(gone)}: not asked for this time; `accept list` has them all")
    certificates = f", {wanted.out / 'certificates'}" if credential else ""
    say(f"results: {wanted.out / 'results.json'}, results.csv, junit.xml{certificates}")
    return report.exit()


def _earlier_serials(out: Path) -> set[str]:
    """Return the serials in the results of an earlier batch."""
    try:
        return {str(unit["serial"]) for unit in json.loads(read_bounded(out / "results.json"))["units"]}
    except (AcceptError, OSError, ValueError, KeyError, TypeError):
        return set()


def specs_for(name: str | None) -> dict[str, Spec]:
    """Return kind -> spec: the one named, or that of every installed product."""
    chosen = [load_spec(name)] if name else default_specs()
    return {spec.kind: spec for spec in chosen}
