"""`accept keys ...`: options and what they mean."""

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="Keys of the authority, technicians and QA.", no_args_is_help=True)

Office = Annotated[Path | None, typer.Option("--authority", help="Folder with ca.key.pem, where it is off the bench.")]
PassphraseFile = Annotated[Path | None, typer.Option("--passphrase-file", help="File with the passphrase.")]
Who = Annotated[str, typer.Argument(help="Name of the person, or sha256 of the certificate.")]


@app.command("init")
def init(
    technician: Annotated[
        str | None, typer.Option(envvar="ACCEPT_OPERATOR", help="Name on the technician's certificate.")
    ] = None,
    qa: Annotated[
        str | None, typer.Option(help="Name on a QA engineer's certificate; without it none is made.")
    ] = None,
    passphrase_file: PassphraseFile = None,
) -> None:
    """Make the bench's authority and the technician's key."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.init(technician, qa, passphrase_file))


@app.command("list")
def show() -> None:
    """The authority and every person's key."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.show())


@app.command("request")
def request(
    role: Annotated[str, typer.Option(help="technician or qa.")],
    name: Annotated[str, typer.Option(help="The person.")],
    out: Annotated[Path | None, typer.Option(help="Where to write the request; else beside the key.")] = None,
    passphrase_file: PassphraseFile = None,
) -> None:
    """Make a person's key and the request for its certificate."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.request(role, name, out, passphrase_file))


@app.command("issue")
def issue(
    file: Annotated[Path, typer.Argument(help="The request.")],
    out: Annotated[Path | None, typer.Option(help="Where to write the certificate; else beside the key.")] = None,
    office: Office = None,
    passphrase_file: PassphraseFile = None,
) -> None:
    """Answer a request with the authority's key. Nobody gets both roles."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.issue(file, out, office, passphrase_file))


@app.command("install")
def install(file: Annotated[Path, typer.Argument(help="The certificate that the authority issued.")]) -> None:
    """Put a certificate beside its key at this bench."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.install(file))


@app.command("revoke")
def revoke(
    who: Who,
    reason: Annotated[str, typer.Option(help="left, lost or compromised.")] = "left",
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="First day; else from now on.")] = None,
    office: Office = None,
    passphrase_file: PassphraseFile = None,
) -> None:
    """Revoke a person's keys. What was signed before stays valid, unless the key was compromised."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.revoke(who, reason, since, office, passphrase_file))


@app.command("renew")
def renew(who: Who, office: Office = None, passphrase_file: PassphraseFile = None) -> None:
    """A new certificate for a person's key, for another five years."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.renew(who, office, passphrase_file))


@app.command("passphrase")
def passphrase(
    who: Annotated[str, typer.Argument(help="Name of the person, or `authority`.")],
    office: Office = None,
    passphrase_file: PassphraseFile = None,
    new_passphrase_file: Annotated[Path | None, typer.Option(help="File with the new passphrase.")] = None,
) -> None:
    """Change the passphrase of a key."""
    from accept.commands.trust import keys as command

    raise typer.Exit(command.passphrase(who, office, passphrase_file, new_passphrase_file))
