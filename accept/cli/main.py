"""The program: every command, by who uses it, in the order of the help."""

from typing import Annotated, Any

import typer

from accept.base import loading
from accept.base.exit_codes import Exit
from accept.cli.lazy_group import Command, Group, LazyGroup

ABOUT = "The acceptance bench for piezo struts: judge units against a written spec, certify them, verify them."

BENCH: dict[str, Command | Group] = {
    "demo": Command("units.demo:run", "Run the whole job on built-in data."),
    "run": Command("bench.run:run", "Measure a unit step by step, up to the signed certificate."),
    "hw": Group(
        "Instruments on the bench.",
        list=Command("bench.hw:show_list", "List the instruments of the bench file."),
        scan=Command("bench.scan:scan", "Find ports and VISA instruments."),
        test=Command("bench.hw:ask", "Ask every instrument for one reading.", ("instrument",)),
        commission=Command("bench.commission:commission", "Commission a real instrument.", ("instrument",)),
        check=Command("bench.check:run", "Compare an instrument with its reference.", ("instrument",)),
        transcript=Command(
            "bench.transcript:run", "Print the bytes that an instrument sent and received.", ("serial",)
        ),
        measure=Command("bench.hw:measure", "Measure a section of a unit with its instrument.", ("file", "check")),
        pickup=Command(
            "bench.hw:pickup", "Copy the rig's next record into a unit folder.", ("file", "file", "check", "file")
        ),
    ),
    "report": Command("units.report:run", "Judge one unit and write its signed certificate."),
    "list": Command("fleet.questions:units", "List the units in the store."),
    "history": Command("fleet.questions:history", "Show every attempt of a unit.", ("serial",)),
    "match": Command("fleet.selection:match", "Find units that fit together."),
    "golden": Group(
        "Golden units: does the bench measure as before?",
        name=Command("fleet.bench_health:golden_name", "Make a judged unit a golden one.", ("serial",)),
        list=Command("fleet.bench_health:golden_list", "List the golden units with their references."),
        check=Command("fleet.bench_health:golden_check", "Compare golden units with their references."),
        chart=Command(
            "fleet.bench_health:golden_charts",
            "Show the chart of each golden unit, with limits of its own repeatability.",
            ("serial",),
        ),
        resolve=Command("fleet.bench_health:golden_resolve", "Let a stopped bench judge again."),
        retire=Command("fleet.bench_health:golden_retire", "Make a golden unit an ordinary one.", ("serial",)),
    ),
}

QUALITY: dict[str, Command | Group] = {
    "batch": Command("units.batch:run", "Judge unit folders."),
    "verify": Command("trust.verify:run", "Verify a certificate from its own bytes."),
    "evidence": Command("trust.evidence:run", "Write all that an auditor needs into one folder."),
    "countersign": Command("trust.countersign:run", "Countersign certificates as QA."),
    "spec": Group(
        "Acceptance specs: list, show, validate.",
        list=Command("units.spec:show_list", "List the specs that come with the program."),
        show=Command("units.spec:show", "Show every limit of a spec with its rule and source.", ("spec",)),
        diff=Command("units.spec:diff", "Compare two specs.", ("spec", "spec")),
        validate=Command("units.spec:validate", "Check specs.", ("spec",)),
        check=Command("units.spec:check", "Check specs, and what their certificates state.", ("spec",)),
        checks=Command("units.spec:checks", "List every check that a spec may ask for."),
        copy=Command("units.spec:copy", "Write a built-in spec as TOML, to change it.", ("spec", "file")),
        approve=Command("trust.approve_spec:run", "Approve a spec with the key of quality assurance.", ("spec",)),
    ),
    "rejudge": Command("fleet.selection:rejudge", "Judge the whole store by another spec."),
    "recall": Command("trust.recall:run", "List the units measured with an instrument or at this bench."),
    "compare": Command("units.compare:run", "Compare units and find which stand out."),
    "yield": Command("fleet.questions:first_pass", "Show the first-pass yield."),
    "trend": Command("fleet.trend:trend", "Show a quantity over time.", ("quantity",)),
    "rr": Command("fleet.bench_health:gauge_study", "Evaluate a gauge study."),
    "gauge": Group(
        "Gauges against references: bias and linearity.",
        bias=Command("fleet.bench_health:gauge_bias", "Evaluate repeated readings of one reference."),
        linearity=Command("fleet.bench_health:gauge_linearity", "Evaluate readings of several references."),
    ),
    "site": Command("fleet.site:run", "Write a page of the fleet."),
}

ENGINEERING: dict[str, Command | Group] = {
    "gap": Command("physics.gap:run", "Name what is missing from the model."),
    "misalign": Command("physics.misalign:run", "Measure how far a strut's APA lies off its axis."),
    "frf": Command("physics.frf:run", "Compute frequency responses of records."),
    "model": Group(
        "The simulated strut: modes, responses, fit.",
        list=Command("physics.model:show_list", "List the models that come with the program, and what each is."),
        effects=Command("physics.model:effects", "List the effects that `accept gap` can name as missing."),
        show=Command("physics.model:show", "Show every parameter with its value, unit and prior."),
        modes=Command("physics.model:modes", "Compute poles, and the zeros of Vs, de and da, with their damping."),
        frf=Command("physics.model:frf", "Compute responses of Vs, de and da to Va."),
        export=Command("physics.model:export", "Write the state space from Va to the channels as a MATLAB file."),
        fit=Command("physics.model_fit:run", "Fit uncertain parameters to a unit's responses."),
        learn=Command("fleet.model_learn:run", "Learn a model from a batch."),
        sweep=Command("physics.model:run_sweep", "Compute poles and zeros over a row of values."),
    ),
    "lookup": Group(
        "Precomputed tables of the misalignment.",
        build=Command("physics.lookup:run_build", "Tabulate the ratio de / da over dx, dy."),
        info=Command("physics.lookup:run_info", "Show the tables that are there, and whether they are whole."),
    ),
    "excite": Group(
        "Excitation signals for the rig, as .mat or .csv.",
        sweep=Command("physics.excite:sweep", "Write a sine of rising frequency."),
        noise=Command("physics.excite:noise", "Write noise in a band."),
        sine=Command("physics.excite:sine", "Write slow sines of growing amplitude, for the hysteresis."),
        multisine=Command("physics.excite:multisine", "Write a random-phase multisine."),
    ),
    "simulate": Group(
        "Simulated units and a simulated bench.",
        bench=Command("bench.simulate_bench:run", "Simulate instruments on pseudo-terminals."),
        unit=Command("bench.simulate:unit", "Simulate a whole unit folder from a model."),
        faults=Command("bench.simulate:faults", "List what can be wrong with a simulated unit."),
    ),
}

ADMINISTRATION: dict[str, Command | Group] = {
    "keys": Group(
        "Keys of the authority, technicians and QA.",
        init=Command("trust.keys:init", "Make the bench's authority and the technician's key."),
        list=Command("trust.keys:show", "List the authority and every person's key."),
        request=Command("trust.keys:request", "Make a person's key and the request for its certificate."),
        issue=Command("trust.keys:issue", "Answer a request with the authority's key."),
        install=Command("trust.keys:install", "Put a certificate beside its key at this bench."),
        revoke=Command("trust.keys:revoke", "Revoke a person's keys."),
        renew=Command("trust.keys:renew", "Renew the certificate of a person's key, for another five years."),
        passphrase=Command("trust.keys:passphrase", "Change the passphrase of a key."),
    ),
    "store": Group(
        "The event store: who did what, when and by which spec.",
        check=Command("trust.store:check", "Walk the chain of events."),
        log=Command("trust.store:log", "List who did what, when, by which spec and code.", ("serial",)),
        head=Command("trust.store:head", "Export the signed head of the chain, to be kept elsewhere."),
        publish=Command("trust.store:publish_list", "Publish the list of judgements and signatures."),
        copies=Command("trust.store:copies", "List recordings filed in two places, and the decisions about them."),
        resolve=Command("trust.store:resolve_copies", "Decide to which unit a recording belongs."),
        void=Command("trust.store:void_attempt", "Declare an attempt at a unit void.", ("serial",)),
        dispose=Command("trust.store:dispose", "Decide about a nonconformance that holds a unit.", ("serial",)),
        backup=Command("trust.store:backup", "Copy the whole store into one file."),
        restore=Command("trust.store:take_back", "Make a backup the bench's store; what was there is set aside."),
    ),
    "product": Group(
        "Products: what can be judged here.",
        list=Command("units.product:show_list", "List the installed products."),
        new=Command("units.product:new", "Write the package of a new product, to be installed."),
        check=Command("units.product:check", "Check a product, installed or in its folder.", ("product",)),
    ),
    "worker": Command("bench.worker:run", "Start workers of a cluster on this machine."),
}

USERS = {
    "Technician, at the bench": BENCH,
    "Quality assurance": QUALITY,
    "Engineer": ENGINEERING,
    "Administration": ADMINISTRATION,
}
COMMANDS = BENCH | QUALITY | ENGINEERING | ADMINISTRATION


class Program(LazyGroup):
    """All commands."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(table=COMMANDS, **settings)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - as typer calls it
        width = max(map(len, COMMANDS))
        for user, commands in USERS.items():
            with formatter.section(user):
                formatter.write_dl([(name.ljust(width), entry.about) for name, entry in commands.items()])


app = typer.Typer(
    name="accept",
    cls=Program,
    help=ABOUT,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from accept.base.version import code_sha256, program

        print(f"accept {program()}, code {code_sha256()[:12]}")
        raise typer.Exit


@app.callback()
def options(
    ctx: typer.Context,
    version: Annotated[  # noqa: ARG001 - its callback answers
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version and hash of the code.")
    ] = False,
    verbose: Annotated[
        int,
        typer.Option(
            "--verbose",
            "-v",
            count=True,
            show_default=False,
            help="Log what is read and opened to stderr; -vv: also every byte on lines.",
        ),
    ] = 0,
) -> None:
    """Read the options of the program itself."""
    if verbose:
        from accept.base.verbose import begin

        begin(verbose, ctx.invoked_subcommand)


def main() -> None:
    """Run the program. A pipe that its reader closed (`accept ... | head`) is no crash."""
    loading.import_nothing_from_here()
    loading.begin()
    loading.log_crashes()
    try:
        app()
    except BrokenPipeError:
        raise SystemExit(Exit.BAD_INPUT) from None
