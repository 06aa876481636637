"""The entries of the command palette: the keys of the screen, the steps of the unit, the units of the bench."""

import asyncio
from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from textual.command import DiscoveryHit, Hit, Hits, Provider
from textual.events import Key

from accept.tui.widgets.key_row import one_of_each
from specs.errors import AcceptError

if TYPE_CHECKING:
    from accept.tui.background.scanning import OpensUnits

Command = tuple[str, str, Callable[[], Any]]
_MOST_UNITS = 200
_HIDDEN = ("ctrl+d",)  # out of the row of keys, and of use


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
        app, units = self.app, cast("OpensUnits", self.app)
        for each in one_of_each(self.screen):
            own = each.binding
            if each.enabled and (own.show or own.key in _HIDDEN):
                key = app.get_key_display(own)
                yield own.description, f"key {key}", partial(app.post_message, Key(own.key.partition(",")[0], None))
        yield "Light or dark", "key F12", partial(app.run_action, "light_or_dark")
        if units.session is not None:
            for step in units.session.steps:
                status = units.session.judgements.status(step)
                yield f"Step {step.short}", f"{status.mark} {status.word}", partial(units.go_to_step, step.name)
        if units.bench is not None and units.session is not None:
            try:
                known = await asyncio.to_thread(units.bench.known)
            except AcceptError:
                return
            for unit in known[:_MOST_UNITS]:
                if unit.serial != units.session.serial:
                    yield f"Unit {unit.serial}", unit.kind, partial(units.go_to, unit.serial, unit.kind, None)
