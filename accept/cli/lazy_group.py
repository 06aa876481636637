"""Groups of commands that are imported when they are called: help and completion read no more than a table."""

from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from accept.cli.options import command_of


@dataclass(frozen=True)
class Command:
    """place: `module:function` in accept.commands; about: the first sentence of the function's docstring."""

    place: str
    about: str


@dataclass(frozen=True)
class Group:
    """Commands under a common name."""

    about: str
    commands: Mapping[str, "Command"]


class LazyGroup(TyperGroup):
    """A group of the commands in a table. Listing and completing their names imports none of them."""

    def __init__(self, *, table: Mapping[str, Command | Group], **settings: Any) -> None:
        super().__init__(**settings)
        self.table = table
        self.commands = LazyCommands(table)

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 - as typer calls it
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002 - as typer calls it
        """Return what help and completion need to know of a command: its name and its first sentence."""
        entry = self.table.get(cmd_name)
        if isinstance(entry, Command):
            return TyperCommand(cmd_name, help=entry.about, rich_markup_mode=None)
        return entry and self.commands[cmd_name]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return name, command and arguments of the command that is called; this imports it."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command and self.commands[str(name)], rest


class LazyCommands(MutableMapping[str, Any]):
    """Commands by name, each imported when it is looked up."""

    def __init__(self, table: Mapping[str, Command | Group]) -> None:
        self.table = table
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = load(name, self.table[name])
        return self._loaded[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        raise TypeError(f"{name}: the table of commands is fixed")

    def __iter__(self) -> Iterator[str]:
        return iter(self.table)

    def __len__(self) -> int:
        return len(self.table)


def load(name: str, entry: Command | Group) -> Any:
    """Return a command, imported, or a group of commands that are not."""
    if isinstance(entry, Group):
        return LazyGroup(table=entry.commands, name=name, help=entry.about, no_args_is_help=True, rich_markup_mode=None)
    module, _, function = entry.place.partition(":")
    program = typer.Typer(add_completion=False, rich_markup_mode=None)
    program.command(name)(command_of(getattr(import_module(f"accept.commands.{module}"), function)))
    return get_command(program)
