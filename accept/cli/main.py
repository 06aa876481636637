"""The commands: thin. Each imports what it runs, so that `accept --help` stays quick."""

from pathlib import Path
from typing import Annotated

import typer

from accept.base.crash_hooks import log_crashes
from accept.base.exit_codes import Exit
from accept.cli.excite import app as excite_app
from accept.cli.fleet import first_pass, gauge_study, golden_app, history, list_units, match, rejudge, site, trend
from accept.cli.hw import app as hw_app
from accept.cli.hw import recall, simulate_app
from accept.cli.keys import app as keys_app
from accept.cli.model import app as model_app
from accept.cli.options import spread
from accept.cli.responses import compare, frf, gap, lookup_app, misalign
from accept.cli.store import app as store_app
from accept.commands.bench.run_options import RunOptions
from accept.commands.options import LargeRecords, Operator, QaPassphrase, TimeStamping
from accept.commands.units.options import BatchOptions, ReportOptions

app = typer.Typer(
    name="accept",
    help="The acceptance bench for piezo struts: judge units against a written spec, certify them, verify them.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
spec_app = typer.Typer(help="Acceptance specs: list, show, validate.", no_args_is_help=True)
app.add_typer(spec_app, name="spec")
app.add_typer(keys_app, name="keys")
app.add_typer(store_app, name="store")
app.add_typer(excite_app, name="excite")
app.add_typer(model_app, name="model")
app.add_typer(lookup_app, name="lookup")
app.add_typer(simulate_app, name="simulate")
app.add_typer(hw_app, name="hw")
app.add_typer(golden_app, name="golden")


def _show_version(wanted: bool) -> None:
    if wanted:
        from accept.base.version import code_sha256, version

        print(f"accept {version()}, code {code_sha256()[:12]}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version and hash of the code.")
    ] = False,
) -> None:
    """The acceptance bench for piezo struts: judge units against a written spec, certify them, verify them."""


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("accept-demo"), operator: Operator = None
) -> None:
    """Run the whole job on built-in data. Judge seven published APAs and a simulated strut, certify, verify."""
    from accept.commands.units import demo as command

    raise typer.Exit(command.run(out, operator))


@app.command()
@spread
def batch(
    units: Annotated[
        list[str], typer.Argument(help="Unit folders, parents of such, or addresses of them (s3://, zip://, https://).")
    ],
    wanted: BatchOptions,
) -> None:
    """Judge unit folders. Writes results.json, results.csv, junit.xml, certificates; judges only what changed."""
    from accept.commands.units import batch as command

    raise typer.Exit(command.run(units, wanted))


@app.command()
@spread
def report(unit: Annotated[Path, typer.Argument(help="Unit folder.")], wanted: ReportOptions) -> None:
    """Judge one unit and write its signed certificate."""
    from accept.commands.units import report as command

    raise typer.Exit(command.run(unit, wanted))


@app.command()
def countersign(
    certificate: Annotated[Path, typer.Argument(help="A certificate that the technician has signed.")],
    passphrase_file: QaPassphrase = None,
    records: LargeRecords = None,
    tsa: TimeStamping = None,
    disposition: Annotated[
        str,
        typer.Option(help="Of a unit that was not accepted: use-as-is, rework, measure-again, return or scrap."),
    ] = "",
    because: Annotated[str, typer.Option(help="Why: the reason of the disposition.")] = "",
) -> None:
    """Countersign a certificate as QA. It is verified first; a unit that was not accepted needs a disposition."""
    from accept.commands.trust import countersign as command

    options = command.CountersignOptions(passphrase_file, records, tsa, disposition, because)
    raise typer.Exit(command.run(certificate, options))


@app.command()
def verify(
    certificate: Annotated[Path, typer.Argument(help="The certificate to check.")],
    trust: Annotated[list[Path] | None, typer.Option(help="CA certificate to trust, not this bench's.")] = None,
    records: LargeRecords = None,
    require: Annotated[str, typer.Option(help="Also require: accepted,countersigned,serial=SERIAL.")] = "",
    spec: Annotated[str | None, typer.Option("--spec", help="The spec that it must have been judged by.")] = None,
    demo: Annotated[bool, typer.Option("--demo", help="A certificate of `accept demo`.")] = False,
    tsa_trust: Annotated[list[Path] | None, typer.Option(help="Root of a time stamping authority to trust.")] = None,
) -> None:
    """Verify a certificate from its own bytes. Signatures, coverage, roles, CA, and the verdict judged again."""
    from accept.commands.trust import verify as command

    required = [word.strip() for word in require.split(",") if word.strip()]
    options = command.VerifyOptions(trust or [], records, required, spec, demo, tsa_trust or [])
    raise typer.Exit(command.run(certificate, options))


@spec_app.command("list")
def spec_list() -> None:
    """The specs that come with the program."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.show_list())


@spec_app.command("show")
def spec_show(name: Annotated[str, typer.Argument(help="Built-in name or TOML file.")]) -> None:
    """Every limit of a spec with its rule and source."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.show(name))


@spec_app.command("validate")
def spec_validate(names: Annotated[list[str], typer.Argument(help="Built-in names or TOML files.")]) -> None:
    """Check specs. One report lists every problem with its file and key path."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.validate(names))


@spec_app.command("checks")
def spec_checks() -> None:
    """Every check that a spec may ask for. What it needs, what it measures, what can be set."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.checks())


@spec_app.command("copy")
def spec_copy(
    name: Annotated[str, typer.Argument(help="Built-in name.")],
    file: Annotated[Path, typer.Argument(help="The TOML file to write.")],
) -> None:
    """Write a built-in spec as TOML, to change it."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.copy(name, file))


@spec_app.command("approve")
def spec_approve(
    file: Annotated[str, typer.Argument(help="TOML file of the spec.")],
    passphrase_file: QaPassphrase = None,
) -> None:
    """Approve a spec with the key of quality assurance."""
    from accept.commands.trust import approve_spec as command

    raise typer.Exit(command.run(file, passphrase_file))


@app.command("run")
@spread
def run_workflow(
    wanted: RunOptions,
    web: Annotated[bool, typer.Option("--web", help="In a browser on this machine (needs the extra 'web').")] = False,
    port: Annotated[int, typer.Option(min=1, max=65535, help="Of --web, on 127.0.0.1.")] = 8000,
) -> None:
    """Measure a unit step by step, up to the signed certificate."""
    from accept.commands.bench import run as command

    raise typer.Exit(command.serve(wanted, port) if web else command.run(wanted))


# After the commands above, which are what most come for: in this order they stand in the help.
for _command, _name in (
    (gap, None),
    (misalign, None),
    (frf, None),
    (compare, None),
    (list_units, "list"),
    (history, None),
    (first_pass, "yield"),
    (trend, None),
    (rejudge, None),
    (recall, None),
    (match, None),
    (gauge_study, "rr"),
    (site, None),
):
    app.command(_name)(_command)


def main() -> None:
    """Entry point. A pipe closed by its reader (`accept ... | head`) is no crash."""
    log_crashes()
    try:
        app()
    except BrokenPipeError:
        raise SystemExit(Exit.BAD_INPUT) from None
