"""Groups of commands that are imported when they are called: help and completion read no more than a table."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from importlib import import_module
from inspect import Parameter, signature
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command


def command_of(function: Callable[..., int]) -> Callable[..., None]:
    """Return a function as typer is to see it: its exit code ends the program, and every parameter that is a dataclass
    is replaced by its fields, in place.

    Annotations of the function and of the dataclasses are types, not strings."""
    asked = signature(function).parameters.values()
    groups: dict[str, Any] = {p.name: p.annotation for p in asked if is_dataclass(p.annotation)}
    seen = [part for p in asked for part in (signature(p.annotation).parameters.values() if p.name in groups else (p,))]
    seen = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in seen]  # so that one without a default may follow another

    @wraps(function)
    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{f.name: given.pop(f.name) for f in fields(group)})
        raise typer.Exit(function(**given))

    del run.__dict__["__wrapped__"]
    run.__dict__["__signature__"] = signature(function).replace(parameters=seen, return_annotation=None)
    run.__annotations__ = {p.name: p.annotation for p in seen}
    return run


@dataclass(frozen=True)
class Command:
    """A command that is imported when it runs. place: `module:function` in accept.commands; about: the first sentence
    of the function's docstring; values: of its arguments, by the names of `accept.cli.completion`."""

    place: str
    about: str
    values: Sequence[str] = ()


class Group:
    """Commands under a common name."""

    def __init__(self, about: str, **commands: Command) -> None:
        self.about, self.commands = about, commands


class AsTyped:
    """Converts the values of a parameter that need no conversion: an option that was left out, plain text. For all
    others the library's own converter takes its place, which pydantic builds: the import of that takes longer than the
    rest of a command line."""

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        """Return the value of a parameter. Raises typer.BadParameter."""
        wanted = param.type_descriptor
        is_plain = wanted.parameter_info.parser is None and not wanted.is_path and type(value) is wanted.annotation
        if param.nargs == 1 and not param.multiple and (value is None or (is_plain and isinstance(value, str | int))):
            return value
        param._runtime_param = None  # noqa: SLF001 - the library makes its own then
        return param.get_runtime_param().coerce(value, param, ctx)

    @classmethod
    def of(cls, params: list[Any]) -> list[Any]:
        """Return parameters that are converted so."""
        for param in params:
            param._runtime_param = cls()  # noqa: SLF001 - as above
        return params


class PlainCommand(TyperCommand):
    """A command that is called."""

    def get_params(self, ctx: Any) -> list[Any]:
        return AsTyped.of(super().get_params(ctx))


class LazyGroup(TyperGroup):
    """A group of the commands in a table. Listing and completing their names imports none of them."""

    def __init__(self, *, table: Mapping[str, Command | Group], **settings: Any) -> None:
        super().__init__(**settings)
        self.table = table
        self.commands: Any = LazyCommands(table)

    def get_params(self, ctx: Any) -> list[Any]:
        return AsTyped.of(super().get_params(ctx))

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002 - as typer calls it
        return list(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002 - as typer calls it
        """Return what help and completion need to know of a command: its name and its first sentence."""
        entry = self.table.get(cmd_name)
        if isinstance(entry, Command):
            return TyperCommand(cmd_name, help=entry.about, rich_markup_mode=None)
        return entry and self.commands[cmd_name]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return name, command and arguments of the called command; imported, but not to complete a word."""
        name, command, rest = super().resolve_command(ctx, args)
        entry = self.table.get(str(name))
        if ctx.resilient_parsing and isinstance(entry, Command):
            return name, _completing(str(name), entry), rest
        return name, command and self.commands[str(name)], rest


class LazyCommands(Mapping[str, Any]):
    """Commands by name, each imported when it is looked up."""

    def __init__(self, table: Mapping[str, Command | Group]) -> None:
        self.table = table
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = load(name, self.table[name])
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.table)

    def __len__(self) -> int:
        return len(self.table)


class CompletingCommand(TyperCommand):
    """A command while a shell completes its words. Its options are those of the command itself."""

    entry: Command

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return the options that begin so."""
        real = load(str(self.name), self.entry)
        with real.make_context(
            self.name, list(ctx.params["words"] or ()), parent=ctx.parent, resilient_parsing=True
        ) as own:
            return real.shell_complete(own, incomplete)


def _completing(name: str, entry: Command) -> Any:
    """Return a command that takes any words and knows what they may be."""

    def offered(ctx: typer.Context, incomplete: str) -> list[str]:
        from accept.cli.completion import values

        return values(entry.values, list(ctx.params.get("words") or ()), incomplete)

    def taken(words: Annotated[list[str] | None, typer.Argument(autocompletion=offered)] = None) -> None: ...

    program = typer.Typer(add_completion=False, rich_markup_mode=None)
    program.command(name, cls=CompletingCommand, context_settings={"ignore_unknown_options": True})(taken)
    command: Any = get_command(program)
    command.entry = entry
    return command


def load(name: str, entry: Command | Group) -> Any:
    """Return a command, imported, or a group of commands that are not."""
    if isinstance(entry, Group):
        return LazyGroup(table=entry.commands, name=name, help=entry.about, no_args_is_help=True, rich_markup_mode=None)
    module, _, function = entry.place.partition(":")
    program = typer.Typer(add_completion=False, rich_markup_mode=None)
    program.command(name, cls=PlainCommand)(command_of(getattr(import_module(f"accept.commands.{module}"), function)))
    return get_command(program)
