"""`accept batch`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from rich.table import Table
from typer import Argument, Option

from accept.base.cluster.connect import connected
from accept.base.console import ask, confirm, say
from accept.base.home import home
from accept.batch import judge_batch
from accept.batch.judge_batch import BatchReport, BatchRequest
from accept.batch.table import actions, explanations, reasons, simulated, units_table
from accept.certificate.trust import Credential
from accept.commands.answer import Answer, Remark, command
from accept.commands.options import ClusterAt, SpecName
from accept.commands.trust.bench_keys import bench_credential, who_acts
from accept.commands.units.options import JudgingOptions
from accept.judging import default_specs, load_spec
from accept.store import open_store
from accept.units.remote_folders import fetched
from specs.bench import load_bench
from specs.errors import AcceptError
from specs.files import json_of, read_bounded
from specs.spec import Spec


@command
def run(
    units: Annotated[
        list[str], Argument(help="Unit folders, folders that contain them, or their addresses (s3://...).")
    ],
    out: Annotated[Path, Option(help="Folder for the results.")],
    spec: SpecName = None,
    no_certificates: Annotated[bool, Option("--no-certificates", help="Judge only; write no certificates.")] = False,
    workers: Annotated[int | None, Option(min=1, help="Number of processes; default: by the amount of work.")] = None,
    cluster: ClusterAt = None,
    *,
    how: JudgingOptions,
) -> Answer:
    """Judge unit folders. Writes results.json, results.csv, junit.xml, certificates; judges only what changed."""
    credential, who = signer(how, not no_certificates)
    paths, refused = fetched(units, out, say)
    with connected(cluster, say) as far, open_store() as store:
        request = BatchRequest(
            paths, out, specs_for(spec), who, credential, workers,
            bench=load_bench(how.bench) if how.bench else None, model=how.model, cluster=far, refused=refused,
            confirm=confirm, reason=how.reason, ask_reason=ask,
        )  # fmt: skip
        listed = _earlier_serials(out)
        report = judge_batch.run(request, store, say)
    unchanged = f"{report.unchanged} of {report.judged} units unchanged since they were judged: not judged again"
    gone = sorted(listed - {u.serial for u in report.units}) if report.units else []
    left_out = f"results.* no longer list {', '.join(gone)}: not asked for this time; `accept list` has them all"
    certificates = f", {out / 'certificates'}" if credential else ""
    return Answer(
        *_lines(report),
        Remark(unchanged if report.unchanged else ""),
        Remark(left_out if gone else ""),
        Remark(f"results: {out / 'results.json'}, results.csv, junit.xml{certificates}"),
        exit=report.exit(),
    )


def _lines(report: BatchReport) -> Iterator[str | Table]:
    if report.units:
        yield units_table(report.units)
        for lines in (simulated, actions, reasons, explanations):
            yield from lines(report.units)
    else:  # too many for a table, or none
        yield from (f"{count} {verdict}" for verdict, count in sorted(report.verdicts.items()))


def _earlier_serials(out: Path) -> set[str]:
    try:
        return {str(unit["serial"]) for unit in json_of(read_bounded(out / "results.json"))["units"]}
    except (AcceptError, OSError, ValueError, KeyError, TypeError):
        return set()


def signer(how: JudgingOptions, certifies: bool = True) -> tuple[Credential | None, str]:
    """Return the key that signs certificates, if any are wanted, and who judges. Raises SpecError, ModelError."""
    if how.model is not None:
        from accept.models.model_file import open_model

        open_model(how.model)  # the one that is named, unlike a spec's, must be there
    credential = bench_credential(home(), how.operator, how.tsa) if certifies else None
    return credential, credential.person if credential else who_acts(how.operator)


def specs_for(name: str | None) -> dict[str, Spec]:
    """Return kind -> spec: the one named, or that of every installed product."""
    chosen = [load_spec(name)] if name else default_specs()
    return {spec.kind: spec for spec in chosen}
