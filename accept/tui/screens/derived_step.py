"""A step without data of its own: what a model says about the records of another step."""

from typing import ClassVar

from textual.binding import Binding, BindingType

from accept.tui.screens.put_right import ask_remedy
from accept.tui.screens.step_view import StepView
from checks.acceptance import CHECKS


class DerivedScreen(StepView):
    """Judges by itself where the records are there and nothing was said about them yet."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "go_on", show=False, priority=True),
        Binding("f3", "compare", "Compare"),
        Binding("f5", "note", "Note"),
        Binding("f7", "picture", "Plots"),
        Binding("ctrl+r", "put_right", "Put right", priority=True),
        Binding("escape", "leave", "Back"),
    ]

    def on_mount(self) -> None:
        if not self.alive:
            return
        self.show()
        if self.complete and self.session.judgement(self.step.name) is None:
            self.judge()
        elif self.complete:
            self.say(f"{self.enter_words}, F3: compare again")
        else:
            self.say(self.lacking(), "bad")

    def lacking(self) -> str:
        other = CHECKS[self.step.check.reads]
        return "" if self.complete else f"Load the records of '{other.short or other.title}' first"

    async def action_go_on(self) -> None:
        """Go on to the next step; what runs is waited for."""
        if await self.take_scan():
            return
        if self.stop is not None:
            self.say("Running. Esc: stop")
        else:
            await self.go_further()

    def action_put_right(self) -> None:
        ask_remedy(self, self.bench, self.session, lambda _: self.leave(False))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave keys of a training out of the footer elsewhere."""
        if action == "put_right":
            return self.bench.training is not None
        return super().check_action(action, parameters)

    def action_compare(self) -> None:
        if self.stop is not None:
            self.say("Running. Esc: stop")
        elif self.complete:
            self.judge()
        else:
            self.say(self.lacking(), "bad")
