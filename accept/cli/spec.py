"""The command lines of `accept spec`."""

from pathlib import Path
from typing import Annotated

import typer

from accept.commands.options import QaPassphrase

app = typer.Typer(help="Acceptance specs: list, show, validate.", no_args_is_help=True)


@app.command("list")
def spec_list() -> None:
    """The specs that come with the program."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.show_list())


@app.command("show")
def spec_show(name: Annotated[str, typer.Argument(help="Built-in name or TOML file.")]) -> None:
    """Every limit of a spec with its rule and source."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.show(name))


@app.command("validate")
def spec_validate(names: Annotated[list[str], typer.Argument(help="Built-in names or TOML files.")]) -> None:
    """Check specs. One report lists every problem with its file and key path."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.validate(names))


@app.command("checks")
def spec_checks() -> None:
    """Every check that a spec may ask for. What it needs, what it measures, what can be set."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.checks())


@app.command("copy")
def spec_copy(
    name: Annotated[str, typer.Argument(help="Built-in name.")],
    file: Annotated[Path, typer.Argument(help="The TOML file to write.")],
) -> None:
    """Write a built-in spec as TOML, to change it."""
    from accept.commands.units import spec as command

    raise typer.Exit(command.copy(name, file))


@app.command("approve")
def spec_approve(
    file: Annotated[str, typer.Argument(help="TOML file of the spec.")],
    passphrase_file: QaPassphrase = None,
) -> None:
    """Approve a spec with the key of quality assurance."""
    from accept.commands.trust import approve_spec as command

    raise typer.Exit(command.run(file, passphrase_file))
