"""Gap analysis: what the model does not explain, by name, and the gap before and after."""

from collections.abc import Mapping
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from accept.base.documents.analyses import REFUSED
from accept.gap import G_NOTE, findings, gap_number, headline_of_document, place_panel
from accept.pictures import signs
from accept.pictures.blocks import Role
from accept.pictures.words import pretty
from accept.store import Event
from accept.tui.screens.page import Page
from accept.tui.widgets.card import Card
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.step_list import GAP, GAP_TITLE
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.worker.not_done import STOPPED
from checks.picture import Panel

WORDS = (
    "Compares the responses with the model. Where they differ, it identifies the missing effect, adds it to the model "
    "and tests the result on records that were not fitted. Takes up to a minute; does not change any verdict."
)


_BANDS = 3  # of the bands in which it shows, the clearest first
COLOURS = {Role.FOUND: "bold", Role.RIVAL: "yellow", Role.UNNAMED: "magenta"}


class Explain(Page):
    """Looks when asked, in the other process; the answer is kept and shown again."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "go_on", "Go on", priority=True),
        Binding("f3", "search", "Measure"),
        Binding("f7", "picture", "Plot"),
        Binding("escape", "leave", "Back"),
    ]

    called: ClassVar[dict[str, str]] = {"f3": "Compare"}  # as at a misalignment

    def __init__(self, bench: Workbench, session: Session) -> None:
        super().__init__(bench, session, WORDS, GAP)

    @property
    def main_key(self) -> str:
        """Return the key of what is to be done next."""
        return "f3" if self.session.gap.found is None else "enter"

    def parts(self) -> ComposeResult:
        yield Card(Hanging(id="answer"), title="Cause", id="cause")

    def on_mount(self) -> None:
        if not self.alive:
            return
        self.entitle(GAP_TITLE)
        self.query_one("#setup").display = False
        self._show()
        if self.session.gap.found is None:
            self.action_search()
        else:
            self.say("Enter: go on, F3: repeat the analysis")

    def _show(self) -> None:
        found = self.session.gap.found
        self.query_one("#side").set_class(found is None, "nothing")
        if self.alive and found is not None:
            self.query_one("#main").add_class("complete")
            self.query_one("#main").set_class(bool(self.session.gap.panels), "plotted")
            self.query_one("#answer", Hanging).hang(answer(found))
            self.pictures.show(pictures_of_gap(self.session))
        self.show_around()

    async def action_go_on(self) -> None:
        """Go on to what is next; what runs is waited for."""
        if await self.action_take_scan():
            return
        if self.stop is not None:
            self.say("Analysis running. Esc: stop")
        else:
            self.leave(True)

    def action_search(self) -> None:
        if self.stop is not None:
            self.say("Analysis running. Esc: stop")
            return
        state = self.session.gap.responses
        if state is None or not state.entries:
            self.query_one("#answer", Hanging).hang(
                Text("No frequency responses yet: record or load them first", "dim")
            )
            self.say("Load the frequency responses first", "bad")
            return
        self.query_one("#answer", Hanging).hang(Text("Analysing … (Esc: stop)", "dim"))
        self.compute(lambda c: c.explain(), self._found, "searching", self._not_found)

    def _found(self, _: Event) -> None:
        self._show()
        self.say("Saved; it appears on the certificate. Enter: go on", "good")

    def _not_found(self, why: str) -> None:
        self.query_one("#answer", Hanging).hang(Text("Not analysed. F3: analyse, Esc: back", "dim"))
        self._show()
        if why == STOPPED:
            self.say("Stopped. F3: analyse again", "doubt")

    def help_text(self) -> str:
        return f"{WORDS}\n\n{G_NOTE} The improved model, gap.json and gap.pdf are in the folder gap/ of the unit."


def pictures_of_gap(session: Session) -> Mapping[str, Panel]:
    """Return the pictures of the answer; where in the strut it sits stands behind the map."""
    panels, found = list(session.gap.panels.items()), session.gap.found or {}
    place = place_panel(found, of_strut=session.spec.kind != "apa")
    return dict([*panels[:1], *([] if place is None else [("place", place)]), *panels[1:]])


def answer(found: Mapping[str, Any]) -> Text:
    """Return the verdict in a few words, then everything that was found, a line each."""
    verdict = str(found["verdict"])
    sign = signs.GAP[verdict]
    words = found["reason"] if verdict == REFUSED else headline_of_document(found)
    text = Text.assemble((f"{sign.mark} {words}", sign.tone.style), "\n")
    if verdict == REFUSED:
        return text
    for each in findings(found):
        text.append(f"  {pretty(each.words)}\n", COLOURS[each.role])
        text.append("".join(f"    {pretty(detail)}\n" for detail in each.details), "dim")
    before, after = found["gap_before"]["channels"], found["gap_after"]["channels"]
    text.append("  G before → after, on unseen records; 1 or less agrees:", "bold")
    text.append("".join(f"\n    {c} {gap_number(G)} → {gap_number(after[c])}" for c, G in before.items()), "bold")
    where = found.get("where", ())
    for each in where[:_BANDS]:
        band = f"{each['f_lo_Hz']:.0f} to {each['f_hi_Hz']:.0f} Hz"
        text.append(f"\n  shows in {each['channel']}, {band}, {each['excess_dB']:.0f} dB above chance", "dim")
    if len(where) > _BANDS:
        text.append(f"\n  and in {len(where) - _BANDS} more bands, as gap.json and the plot have them", "dim")
    return text
