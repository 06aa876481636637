"""The page of all commands, from the commands themselves: `python -m accept.cli.reference > docs/reference/cli.md`."""

from collections.abc import Iterator
from typing import Any

from typer.main import get_command

from accept.cli.main import app

HEAD = """# Commands

Written by `python -m accept.cli.reference` from the commands themselves. `accept COMMAND -h` says the same in a
terminal. Exit codes: 0 accepted, 3 rejected, 4 incomplete or conditional, 5 an instrument does not answer, 6 bad input,
130 stopped with Ctrl-C. 1 is a fault of the program, 2 a wrong option.
"""


def reference() -> str:
    """Return the markdown of every command: usage, what it does, its arguments and options."""
    return "\n".join([HEAD, *_commands("accept", get_command(app))])


def _commands(path: str, command: Any) -> Iterator[str]:
    group = getattr(command, "commands", None)
    if group is None:
        yield _page(path, command)
        return
    for name, part in sorted(group.items()):
        if not part.hidden:
            yield from _commands(f"{path} {name}", part)


def _page(path: str, command: Any) -> str:
    asked = [p for p in command.params if not getattr(p, "hidden", False) and p.name != "help"]
    arguments = " ".join(_name(p) for p in asked if p.param_type_name == "argument")
    rows = [f"| `{_name(p)}` | {_words(p)} |" for p in asked]
    table = "\n".join(["| | |", "|---|---|", *rows]) if rows else ""
    about = " ".join((command.help or "").split())
    return f"## {path}\n\n`{path} {arguments}`\n\n{about}\n\n{table}\n".replace(" `\n", "`\n", 1)


def _name(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return (parameter.name or "").upper() + ("..." if parameter.nargs == -1 else "")
    shown = ", ".join((*parameter.opts, *parameter.secondary_opts))
    return shown.replace("|", "\\|")


def _words(parameter: Any) -> str:
    words = " ".join((getattr(parameter, "help", None) or "").split()).replace("|", "\\|").replace("<", "&lt;")
    choices = getattr(getattr(parameter, "type", None), "choices", None)
    one_of = f" One of {', '.join(map(str, choices))}." if choices else ""
    default = parameter.default
    plain = isinstance(default, str | int | float) and not isinstance(default, bool) and str(default)
    said = f" Default: `{getattr(default, 'value', default)}`." if plain else ""
    return f"{words}{one_of}{said}"


if __name__ == "__main__":
    print(reference(), end="")
