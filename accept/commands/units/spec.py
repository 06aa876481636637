"""`accept spec`. The checks' declarations are loaded when they are needed, since it takes longer than all the rest."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.atomic_files import write_atomic
from accept.base.documents import listings
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.commands.answer import Answer, File, Remark, command, table
from accept.commands.options import JsonAnswer
from specs.spec import Limit, Spec, builtin, differences, load, parse
from specs.strict import SpecError


@command
def show_list(json: JsonAnswer = None) -> Answer:
    """List the specs that come with the program."""
    specs = [load(name) for name in builtin()]
    listed = map(_listed, specs)
    rows = ((spec.name, spec.kind, str(len(spec.checks)), spec.title) for spec in specs)
    return Answer(File(json, listings.SpecList(tuple(listed))), table(("name", "kind", "checks", "title"), rows))


def _listed(spec: Spec) -> listings.SpecListed:
    return listings.SpecListed(spec.name, spec.kind, spec.title, tuple(spec.checks), spec.sha256)


@command
def diff(
    first: Annotated[str, Argument(help="Built-in name, TOML file, or certificate that states one.")],
    second: Annotated[str, Argument(help="The other.")],
    json: JsonAnswer = None,
) -> Answer:
    """Compare two specs. Each limit, setting and source that differs; exit 4 if any does."""
    specs = [_spec_in(Path(name)) if name.lower().endswith(".pdf") else load(name) for name in (first, second)]
    found = list(differences(*specs))
    one, two = map(_listed, specs)
    document = listings.SpecsCompared(one, two, tuple(listings.SpecValueDiffers(*each) for each in found))
    names = [f"{name}: {spec.name} {spec.sha256[:12]}" for name, spec in zip((first, second), specs, strict=True)]
    rows = ((key.removeprefix("checks."), *map(_stated, values)) for key, *values in found)
    return Answer(
        File(json, document),
        table(("value", *names), rows)
        if found
        else f"{' and '.join(names)} state the same limits, settings and sources",
        exit=Exit.INCOMPLETE if found else Exit.ACCEPTED,
    )


def _spec_in(certificate: Path) -> Spec:
    """Return the spec that a certificate was judged by. Raises SpecError, OSError, InvalidCertificate."""
    from accept.certificate import read_certificate, read_contents

    return parse(read_contents(read_certificate(certificate)).spec_text.encode(), str(certificate))


def _stated(value: object) -> str:
    return "not stated" if value is None else f"{value:.12g}" if isinstance(value, float) else str(value)


@command
def show(name: Annotated[str, Argument(help="Built-in name or TOML file.")], json: JsonAnswer = None) -> Answer:
    """Show every limit of a spec with its rule and source."""
    spec = load(name)
    head = (f"{spec.name} ({spec.kind}): {spec.title}", f"sha256 {spec.sha256}")
    limits = table(("check", "quantity", "limits", "rule", "source"), _rows(spec))
    compared = "responses are compared with model '{}'; this does not affect the verdict"
    gap = None if spec.gap is None else compared.format(spec.gap.model)
    unknown_to_checks = approved = None
    if name not in builtin():
        from accept.commands.trust.approve_spec import approval_words
        from accept.judging import load_spec

        approved = approval_words(spec)
        try:
            load_spec(name)
        except SpecError as e:
            unknown_to_checks = e
    return Answer(File(json, _document(spec)), *head, approved, limits, gap, error=unknown_to_checks)


def _document(spec: Spec) -> listings.SpecShown:
    limits = [
        listings.LimitShown(
            check, section.required, quantity, limit.lower, limit.upper, limit.unit, str(limit.rule), limit.source,
            limit.assumed,
        )
        for check, section in spec.checks.items()
        for quantity, limit in section.limits.items()
    ]  # fmt: skip
    return listings.SpecShown(spec.name, spec.kind, spec.title, spec.sha256, tuple(limits))


def _rows(spec: Spec) -> Iterator[tuple[str, ...]]:
    for check, section in spec.checks.items():
        needed = "" if section.required else " (optional)"
        for quantity, limit in section.limits.items():
            source = f"ASSUMED: {limit.source}" if limit.assumed else limit.source
            yield check + needed, quantity, interval(limit), limit.rule, source


def interval(limit: Limit) -> str:
    """Return limits in words: `4.4 to 5.5 uF`, `at least 304 um`."""
    if limit.lower is None:
        return f"at most {limit.upper:g} {limit.unit}"
    if limit.upper is None:
        return f"at least {limit.lower:g} {limit.unit}"
    return f"{limit.lower:g} to {limit.upper:g} {limit.unit}"


@command
def validate(names: Annotated[list[str], Argument(help="Built-in names or TOML files.")]) -> Answer:
    """Check specs. One report lists every problem with its file and key path."""
    found, words = _loaded(names)
    return Answer(*words, exit=Exit.BAD_INPUT if len(found) < len(names) else Exit.ACCEPTED)


@command
def check(
    names: Annotated[list[str], Argument(help="Built-in names or TOML files.")],
    iso17025: Annotated[
        bool, Option("--iso17025", help="Name what their certificates lack of ISO/IEC 17025 7.8; exit 4.")
    ] = False,
    unit: Annotated[Path | None, Option(help="With --iso17025: a unit folder that is looked at too.")] = None,
) -> Answer:
    """Check specs, and what their certificates state. As `validate`, and on demand clause by clause."""
    found, words = _loaded(names)
    complete = [_is_complete(spec, unit, words) for spec in found if iso17025]
    exit = Exit.ACCEPTED if all(complete) else Exit.INCOMPLETE
    return Answer(*words, exit=Exit.BAD_INPUT if len(found) < len(names) else exit)


def _loaded(names: Sequence[str]) -> tuple[list[Spec], list[str]]:
    from accept.judging import load_spec, spec_warnings

    found, words = [], list[str]()
    for name in names:
        try:
            spec = load_spec(name)
        except SpecError as e:
            words.append(Remark(e))
            continue
        found.append(spec)
        words.append(f"{name}: valid, {spec.kind}, sha256 {spec.sha256}")
        words += [Remark(f"warning: {name}: {warning}") for warning in spec_warnings(spec)]
    return found, words


def _is_complete(spec: Spec, folder: Path | None, words: list[str]) -> bool:
    """Return whether certificates of a spec lack nothing, and add lines about what they lack. Raises SpecError,
    UnitError."""
    from accept import units
    from accept.certificate import LABORATORY_FILE, laboratory_of, missing_statements

    found = missing_statements(laboratory_of(home()), spec, units.read(folder) if folder else None)
    words += [f"{spec.name}: {each.words}" for each in found]
    if any(each.where.startswith(LABORATORY_FILE) for each in found):
        words.append(Remark(f"{LABORATORY_FILE} belongs into the folder of the bench: {home() / LABORATORY_FILE}"))
    if not found:
        words.append(f"{spec.name}: everything that ISO/IEC 17025 7.8 asks a laboratory to state is stated")
    return not found


@command
def copy(
    name: Annotated[str, Argument(help="Built-in name.")],
    file: Annotated[Path, Argument(help="The TOML file to write.")],
) -> Answer:
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
    return Answer(f"{file}: spec '{own}', a copy of '{name}' ({load(name).sha256[:12]}); change its limits there")


@command
def checks() -> Answer:
    """List every check that a spec may ask for. What it needs, what it measures, what can be set."""
    from accept.commands.units.check_docs import all_checks

    return Answer(*all_checks().splitlines())
