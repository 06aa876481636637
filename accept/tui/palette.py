"""What the command palette offers: the keys of the screen, the steps of the unit, the units of the bench."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, cast

from textual.binding import Binding
from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.events import Key
from textual.message import Message

from accept.tui.widgets.key_row import one_of_each
from specs.errors import AcceptError

if TYPE_CHECKING:
    from accept.workflow.bench import Workbench
    from accept.workflow.session import Session

Command = tuple[str, str, Callable[[], Awaitable[None] | None]]
_MOST_UNITS = 200
_HIDDEN = ("ctrl+d",)  # out of the row of keys, and of use


class Commanded(Protocol):
    """What the palette asks of the application."""

    session: "Session | None"
    bench: "Workbench | None"

    def action_light_or_dark(self) -> None:
        """Change the colours."""

    def get_key_display(self, binding: Binding) -> str:
        """Return a key as it is printed."""

    async def go_to_step(self, name: str) -> None:
        """Open a step of this unit."""

    async def go_to(self, serial: str, kind: str, queue: Any) -> None:
        """Open another unit."""

    def post_message(self, message: Message) -> bool:
        """Take a key."""


class BenchCommands(Provider):
    """Commands by their names; what is typed leaves those that hold its letters."""

    async def discover(self) -> Hits:
        async for name, more, run in self._commands():
            yield DiscoveryHit(name, run, help=more)

    async def search(self, query: str) -> Hits:
        matcher = self.matcher(query)
        async for name, more, run in self._commands():
            if (score := matcher.match(name)) > 0:
                yield Hit(score, matcher.highlight(name), run, help=more)

    async def _commands(self) -> AsyncIterator[Command]:
        app = cast(Commanded, self.app)
        for each in one_of_each(self.screen):
            own = each.binding
            if each.enabled and (own.show or own.key in _HIDDEN):
                key = app.get_key_display(own)
                yield own.description, f"key {key}", partial(_press, app, own.key.partition(",")[0])
        yield "Light or dark", "key F12", app.action_light_or_dark
        if app.session is not None:
            for step in app.session.steps:
                status = app.session.judgements.status(step)
                yield f"Step {step.short}", f"{status.mark} {status.word}", partial(app.go_to_step, step.name)
        if app.bench is not None and app.session is not None:
            try:
                known = await asyncio.to_thread(app.bench.known)
            except AcceptError:
                return
            for unit in known[:_MOST_UNITS]:
                if unit.serial != app.session.serial:
                    yield f"Unit {unit.serial}", unit.kind, partial(app.go_to, unit.serial, unit.kind, None)


def _press(app: Commanded, key: str) -> None:
    app.post_message(Key(key, None))
