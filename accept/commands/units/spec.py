"""`accept spec`. The checks' declarations are loaded when they are needed, since it takes longer than all the rest."""

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from accept.base.atomic_files import write_atomic
from accept.base.console import clear_errors, say, stdout
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import LimitShown, SpecList, SpecListed, SpecShown
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.commands.options import JsonAnswer
from specs.spec import Limit, Spec, builtin, load
from specs.strict import SpecError


@clear_errors
def show_list(json: JsonAnswer = None) -> Exit:
    """List the specs that come with the program."""
    check_answer(json)
    specs = [load(name) for name in builtin()]
    listed = [SpecListed(spec.name, spec.kind, spec.title, tuple(spec.checks), spec.sha256) for spec in specs]
    if wants_text(json, SpecList(tuple(listed))):
        table = Table("name", "kind", "checks", "title")
        for spec in specs:
            table.add_row(spec.name, spec.kind, str(len(spec.checks)), spec.title)
        stdout.print(table)
    return Exit.ACCEPTED


@clear_errors
def show(name: Annotated[str, typer.Argument(help="Built-in name or TOML file.")], json: JsonAnswer = None) -> Exit:
    """Show every limit of a spec with its rule and source."""
    check_answer(json)
    spec = load(name)
    if wants_text(json, _document(spec)):
        _show(spec)
    if name not in builtin():  # what it asks of checks that they do not know
        from accept.judging.judge_unit import load_spec

        load_spec(name)
    return Exit.ACCEPTED


def _document(spec: Spec) -> SpecShown:
    limits = [
        LimitShown(
            check, section.required, quantity, limit.lower, limit.upper, limit.unit, str(limit.rule), limit.source,
            limit.assumed,
        )
        for check, section in spec.checks.items()
        for quantity, limit in section.limits.items()
    ]  # fmt: skip
    return SpecShown(spec.name, spec.kind, spec.title, spec.sha256, tuple(limits))


def _show(spec: Spec) -> None:
    for line in (f"{spec.name} ({spec.kind}): {spec.title}", f"sha256 {spec.sha256}"):
        stdout.print(line)
    table = Table("check", "quantity", "limits", "rule", "source")
    for check, section in spec.checks.items():
        needed = "" if section.required else " (optional)"
        for quantity, limit in section.limits.items():
            source = f"ASSUMED: {limit.source}" if limit.assumed else limit.source
            table.add_row(check + needed, quantity, interval(limit), limit.rule, source)
    stdout.print(table)
    if spec.gap is not None:
        stdout.print(f"responses are compared with model '{spec.gap.model}'; this does not affect the verdict")


def interval(limit: Limit) -> str:
    """Return limits in words: `4.4 to 5.5 uF`, `at least 304 um`."""
    if limit.lower is None:
        return f"at most {limit.upper:g} {limit.unit}"
    if limit.upper is None:
        return f"at least {limit.lower:g} {limit.unit}"
    return f"{limit.lower:g} to {limit.upper:g} {limit.unit}"


@clear_errors
def validate(names: Annotated[list[str], typer.Argument(help="Built-in names or TOML files.")]) -> Exit:
    """Check specs. One report lists every problem with its file and key path."""
    found = [_valid(name) for name in names]  # all of them, so that one report lists every problem
    return Exit.BAD_INPUT if None in found else Exit.ACCEPTED


@clear_errors
def check(
    names: Annotated[list[str], typer.Argument(help="Built-in names or TOML files.")],
    iso17025: Annotated[
        bool, typer.Option("--iso17025", help="Name what their certificates lack of ISO/IEC 17025 7.8; exit 4.")
    ] = False,
    unit: Annotated[Path | None, typer.Option(help="With --iso17025: a unit folder that is looked at too.")] = None,
) -> Exit:
    """Check specs, and what their certificates state. As `validate`, and on demand clause by clause."""
    found = [_valid(name) for name in names]
    lacking = [iso17025 and _lacking(spec, unit) for spec in found if spec is not None]
    return Exit.BAD_INPUT if None in found else Exit.INCOMPLETE if any(lacking) else Exit.ACCEPTED


def _valid(name: str) -> Spec | None:
    """Print whether a spec is valid and return it, None if it is not."""
    from accept.judging.judge_unit import load_spec, spec_warnings

    try:
        spec = load_spec(name)
    except SpecError as e:
        say(str(e))
        return None
    stdout.print(f"{name}: valid, {spec.kind}, sha256 {spec.sha256}")
    for warning in spec_warnings(spec):
        say(f"warning: {name}: {warning}")
    return spec


def _lacking(spec: Spec, folder: Path | None) -> bool:
    """Print what certificates of a spec would lack; return whether they lack anything. Raises SpecError, UnitError."""
    from accept.certificate.contents.iso17025 import missing
    from accept.certificate.contents.laboratory import FILE, laboratory_of
    from accept.units import unit_folder

    found = missing(laboratory_of(home()), spec, unit_folder.read(folder) if folder else None)
    for each in found:
        stdout.print(f"{spec.name}: {each.words}", soft_wrap=True)
    if any(each.where.startswith(FILE) for each in found):
        say(f"{FILE} belongs into the folder of the bench: {home() / FILE}")
    if not found:
        stdout.print(f"{spec.name}: everything that ISO/IEC 17025 7.8 asks a laboratory to state is stated")
    return bool(found)


@clear_errors
def copy(
    name: Annotated[str, typer.Argument(help="Built-in name.")],
    file: Annotated[Path, typer.Argument(help="The TOML file to write.")],
) -> Exit:
    """Write a built-in spec as TOML, to change it."""
    import tomlkit

    if file.exists():
        raise SpecError(str(file), ["is there already; name a file that is not"])
    builtins = builtin()
    if name not in builtins:
        raise SpecError(name, [f"no such built-in spec (there are {', '.join(builtins)})"])
    document = tomlkit.parse(builtins[name].read_text("utf-8"))
    # With another name than the built-in spec has, so that it is not taken for it.
    own = file.stem if file.stem not in builtins else f"{file.stem}-copy"
    document["name"] = own
    write_atomic(file, tomlkit.dumps(document).encode("utf-8"))
    stdout.print(f"{file}: spec '{own}', a copy of '{name}' ({load(name).sha256[:12]}); change its limits there")
    return Exit.ACCEPTED


@clear_errors
def checks() -> Exit:
    """List every check that a spec may ask for. What it needs, what it measures, what can be set."""
    from accept.commands.units.check_docs import all_checks

    print(all_checks(), end="")
    return Exit.ACCEPTED
