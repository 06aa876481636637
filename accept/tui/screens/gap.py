"""What the model does not explain of the measured responses: named, added, and the gap before and after."""

from collections.abc import Mapping
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Label, Static

from accept.gap.text import HEADLINE, REFUSED, number, parameters, values_of
from accept.store import Event
from accept.tui.background.process_work import send_to_worker
from accept.tui.screens.page import Page
from accept.tui.widgets.pictures import Pictures
from accept.workflow.bench import Workbench
from accept.workflow.session import Session

TITLE = "What the model does not explain"
_WORDS = (
    "The responses are held against the model; where they differ, the missing physics is looked for by name, added, "
    "and judged on records that were not fitted. It takes up to a minute and bears on no verdict."
)
COLOUR = {
    "no_missing_effect": "green",
    "explained": "green",
    "ambiguous": "yellow",
    "partly_explained": "yellow",
    "unexplained": "magenta",
    REFUSED: "magenta",
}
_MARK = {"green": "✓", "yellow": "~", "magenta": "?"}


class Explain(Page):
    """Looks when asked, in the other process; the answer is kept and shown again."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f3", "search", "Search"),
        Binding("f7", "picture", "Plot"),
        Binding("escape", "leave", "Back"),
    ]

    def __init__(self, bench: Workbench, session: Session) -> None:
        super().__init__(bench, session, _WORDS)

    def parts(self) -> ComposeResult:
        yield Static("", id="answer", markup=False)

    def on_mount(self) -> None:
        if not self.alive:
            return
        self.query_one("#head", Label).update(f"{TITLE}  ·  {self.session.serial}")
        self._show()
        if self.session.gap is None:
            self.action_search()
        else:
            self.say("F3 searches once more")

    def _show(self) -> None:
        found = self.session.gap
        if self.alive and found is not None:
            self.query_one("#answer", Static).update(answer(found))
            self.query_one(Pictures).show(self.session.gap_panels)

    def action_search(self) -> None:
        if self.stop is not None:
            self.say("it is under way; Esc stops it")
            return
        state = self.session.responses
        if state is None or not state.entries:
            self.say("first the records of the frequency responses", "bad")
            return
        self.query_one("#answer", Static).update(Text("searching … (Esc stops it)", "dim"))
        explain = self.session.explain
        send_to_worker(self, self.bench.worker, lambda e: explain(e.explain), self._found, "searching", self._not_found)

    def _found(self, event: Event) -> None:
        self._show()
        self.say(f"stored as event {event.seq}; it goes on the certificate", "good")

    def _not_found(self, _: str) -> None:
        self.query_one("#answer", Static).update("")
        self._show()

    def help_text(self) -> str:
        return (
            f"{_WORDS}\n\nG is the squared residual over noise and the model's tolerance, per degree of freedom; "
            "1 or less is agreement. The improved model, gap.json and gap.pdf lie in the unit's folder, in gap/."
        )


def headline(found: Mapping[str, Any]) -> Text:
    """The verdict in a few words, with mark and colour."""
    verdict = str(found["verdict"])
    colour = COLOUR[verdict]
    words = found["reason"] if verdict == REFUSED else HEADLINE[verdict]
    return Text(f"{_MARK[colour]} {words}", colour)


def answer(found: Mapping[str, Any]) -> Text:
    """Everything that was found, a line each."""
    text = Text.assemble(headline(found), "\n")
    if found["verdict"] == REFUSED:
        return text
    for effect in found["named"]:
        text.append(f"  {effect['sentence']}\n", "bold")
        text.append(f"    {effect['effect']}: {parameters(values_of(effect))}\n", "dim")
    for rivals in found["ambiguous"]:
        text.append(f"  not told apart: {', '.join(rivals['effects'])}. To tell: {rivals['experiment']}\n", "yellow")
    for nameless in found["unnamed"]:
        poles = ", ".join(f"{f:.1f}" for f in nameless["poles_Hz"]) or "no pole"
        text.append(f"  without a name: {nameless['channel']}, {poles} Hz. {nameless.get('words', '')}\n", "magenta")
    before, after = found["gap_before"]["channels"], found["gap_after"]["channels"]
    shrunk = "   ".join(f"{c} {number(G)} → {number(after[c])}" for c, G in before.items())
    text.append(f"  gap on unseen records, before → after:  {shrunk}", "bold")
    return text
