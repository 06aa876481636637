"""`accept store ...`: options and what they mean."""

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="The event store: who did what, when and by which spec.", no_args_is_help=True)


@app.command("check")
def check(
    head: Annotated[Path | None, typer.Option(help="An exported head, or a certificate that states one.")] = None,
) -> None:
    """Walk the chain of events. Names the first that is altered or missing."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.check(head))


@app.command("log")
def log(
    serial: Annotated[str | None, typer.Argument(help="Only events of this unit.")] = None,
    full: Annotated[bool, typer.Option("--full", help="With payload and hash of every event.")] = False,
) -> None:
    """Who did what, when, with which verdict, by which spec and code."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.log(serial, full))


@app.command("head")
def head(out: Annotated[Path | None, typer.Option(help="File to write; else stdout.")] = None) -> None:
    """Export the signed head of the chain, to be kept elsewhere."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.head(out))


@app.command("copies")
def copies() -> None:
    """Recordings that stand in two places, and whose they are."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.copies())


@app.command("resolve")
def resolve(
    serial: Annotated[str, typer.Argument(help="A unit that shares a recording with another place.")],
    measured: Annotated[list[str], typer.Option(help="Whose it is: SERIAL, or SERIAL:section/input. Repeatable.")],
    reason: Annotated[str, typer.Option(help="How it came to stand in two places.")],
    operator: Annotated[str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Who says so.")] = None,
) -> None:
    """Say whose a recording is that stands in two places."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.resolve_copies(serial, measured, reason, operator))


@app.command("backup")
def backup(file: Annotated[Path, typer.Argument(help="File to write, with its head beside it.")]) -> None:
    """Copy the whole store into one file."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.backup(file))


@app.command("restore")
def restore(file: Annotated[Path, typer.Argument(help="A file that `accept store backup` wrote.")]) -> None:
    """Make a backup the bench's store; what was there is set aside."""
    from accept.commands.trust import store as command

    raise typer.Exit(command.take_back(file))
