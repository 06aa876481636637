"""`accept batch`."""

from pathlib import Path

from accept.base.console import clear_errors, operator_name, say, stdout
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.batch import judge_batch
from accept.batch.table import explanations, reasons, units_table
from accept.commands.trust.bench_keys import bench_credential
from accept.judging.judge_unit import DEFAULT_SPEC, load_spec
from accept.models.model_file import open_model
from accept.store import open_store
from specs.bench import load_bench
from specs.spec import Spec


@clear_errors
def run(
    paths: list[Path],
    out: Path,
    spec: str | None,
    certificates: bool,
    workers: int | None,
    operator: str | None,
    bench: Path | None = None,
    model: str | None = None,
) -> Exit:
    """Judge the units at or below `paths`. See `accept.batch.run`."""
    if model is not None:
        open_model(model)  # the one that is named, unlike a spec's, must be there
    credential = bench_credential(home(), operator) if certificates else None
    who = credential.person if credential else operator_name(operator)
    order = judge_batch.BatchRequest(
        paths, out, specs_for(spec), who, credential, workers, bench=load_bench(bench) if bench else None, model=model
    )
    with open_store() as store:
        report = judge_batch.run(order, store, say)
    if report.units:
        stdout.print(units_table(report.units))
        for line in (*reasons(report.units), *explanations(report.units)):
            print(line)
    if report.unchanged:
        say(f"{len(report.unchanged)} of {len(report.units)} units unchanged since they were judged: not judged again")
    say(
        f"results: {out / 'results.json'}, results.csv, junit.xml" + (f", {out / 'certificates'}" if credential else "")
    )
    return report.exit()


def specs_for(name: str | None) -> dict[str, Spec]:
    """kind -> spec: the one named, or the built-in one of every kind."""
    chosen = [load_spec(name)] if name else [load_spec(default) for default in DEFAULT_SPEC.values()]
    return {spec.kind: spec for spec in chosen}
