"""The end of a unit: renders its dialogue, passes on keys and executes effects; what they mean is decided there."""

import os
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Label, Static

from accept.base.documents.results import UnitRecord
from accept.pictures import signs
from accept.pictures.labels import label_of
from accept.tui.background.scanning import Scanning
from accept.tui.screens.ask import Help, Question, QuestionLine
from accept.tui.screens.put_right import ask_remedy
from accept.tui.widgets.banner import Banner
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.limit_bar import after_number, limits, numbers
from accept.tui.widgets.step_list import HELD, UnitBar, held_words, where_held
from accept.workflow.bench import Workbench
from accept.workflow.dialogue import summary as dialogue
from accept.workflow.dialogue.summary import Do
from accept.workflow.dialogue.summary_state import SummaryDialogue, Turn
from accept.workflow.effects.serve_summary import facts
from accept.workflow.session import Session
from accept.workflow.steps.status import Status

SOUND = "ACCEPT_SOUND"  # 1: the result can be heard, one stroke of the bell if accepted, else three
_BETWEEN_BELLS_S = 0.4
_NO_RESULT = "no\N{NO-BREAK SPACE}result"  # not broken at the end of a line


class Summary(Scanning):
    """Judges the unit when it opens. Dismisses True for the next unit, False to go back to the steps."""

    asks_passphrase = True
    where_signed = "A passphrase: F2 first"
    press = staticmethod(dialogue.press)

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "take_scan", show=False, priority=True),
        Binding("f2", "press('f2')", "Sign", priority=True),
        Binding("f3", "press('f3')", "QA countersigns"),
        Binding("f4", "press('f4')", "Next unit", priority=True),
        Binding("ctrl+r", "press('ctrl+r')", "Put right"),
        Binding("ctrl+l", "press('ctrl+l')", "Forget passphrase", show=False),
        Binding("pagedown", "page(1)", "More", priority=True),
        Binding("pageup", "page(-1)", show=False, priority=True),
        Binding("escape", "press('escape')", "Back", priority=True),
    ]

    def __init__(self, bench: Workbench, session: Session) -> None:
        super().__init__(bench, session)
        self.signing = bench.services.signing(session)
        self.dialogue: SummaryDialogue = SummaryDialogue(facts(session))
        self._shown: object = None  # the result that the table shows
        self._told: object = None  # the finding that the lines below it are about, and these

    def compose(self) -> ComposeResult:
        yield UnitBar(self.session, "summary")
        yield Banner()
        yield Static("Evaluating …", id="verdict", markup=False)
        yield DataTable(id="findings", cursor_type="row", cell_padding=0)
        with VerticalScroll(id="why", can_focus=False):
            yield Static("", id="detail", markup=False)
        yield Static("", id="certificate", markup=False)
        yield Label("", id="status")
        yield KeyRow()

    async def on_mount(self) -> None:
        if self.alive:
            table = self.query_one(DataTable)
            table.add_columns("", "Quantity ", "Value ± U ", "Limits ", "Verdict")
            table.visible = False  # its head alone says nothing
            await self.follow(dialogue.opening(self.at_present().state.facts))

    def takes_scans(self) -> bool:
        """Return whether letters are a serial: before the result they may be a passphrase that is typed ahead."""
        return self.session.judgements.result is not None

    def at_present(self) -> Turn:
        now = replace(facts(self.session), idle=self.idle, in_front=self.in_front)
        return Turn(replace(self.dialogue, facts=now))

    async def execute(self, effect: object) -> None:
        operator, shift = self.session.operator, self.bench_app.shift
        match effect:
            case Do.JUDGE:
                self.compute(
                    lambda c: c.judge(), lambda _: self.later(dialogue.judged),
                    "judging the unit", lambda _: self.later(dialogue.not_judged),
                )  # fmt: skip
            case Do.LOCK:
                self.say("The passphrase is forgotten" if shift.lock() else "No passphrase is kept")
            case Do.NEXT_UNIT:
                await self.saved()
                self.leave(True)
            case Do.STOP_OR_LEAVE:
                await self.action_leave()
            case Do.ASK_REMEDY:
                ask_remedy(self, lambda _: self.leave(False))
            case Do.TELL_HIDDEN if self.bench.training is not None:
                told = Help("Training: what this unit had", self.bench.training.hidden, "next unit")
                self.app.push_screen(told, lambda further: self.leave(True) if further else None)
            case Do.RING if os.environ.get(SOUND, "").strip() == "1":
                for n in range(1 if self.dialogue.accepted else 3):
                    self.set_timer(n * _BETWEEN_BELLS_S + 0.01, self.app.bell)
            case dialogue.LookForKeys(role):
                keys = replace(self.signing.keys(role), kept=shift.passphrase(operator) is not None)
                await self.answer(dialogue.keys_found, effect, keys)
            case dialogue.Ask():
                await self._ask(effect)
            case dialogue.KeepPassphrase(passphrase):
                shift.keep(operator, passphrase)
            case dialogue.SignAsTechnician(passphrase) if effect.makes_keys:
                self.send(
                    lambda: self.signing.make_keys(passphrase),
                    lambda left: self.later(dialogue.keys_made, effect, str(left)),
                    "making keys",
                )
            case dialogue.SignAsTechnician(first=first) if first:
                told = Help("Keys were created", first)
                self.app.push_screen(told, lambda _: self.call_next(self.execute, replace(effect, first="")))
            case dialogue.SignAsTechnician(typed, reason):
                opens = typed or shift.passphrase(operator)
                if opens is None:  # the bench was left while the question stood
                    await self.answer(dialogue.press, "f2")
                    return
                self.send(
                    lambda: self.signing.sign(opens, reason),
                    partial(self._signed, opens),
                    "signing and verifying",
                )
            case dialogue.Countersign(passphrase, choice, reason):
                self.send(
                    lambda: self.signing.countersign(passphrase, choice, reason),
                    partial(self.later, dialogue.signed),
                    "countersigning and verifying",
                )

    async def _ask(self, asked: dialogue.Ask) -> None:
        """Ask; keys that follow wait for the question, so that no passphrase goes elsewhere."""
        words = self._what_is_signed().append(f"\n\n{asked.words}", "not bold default") if asked.states else asked.words
        lines = [QuestionLine(line.value, secret=line.is_secret) for line in asked.lines]
        question = Question(asked.title, words, lines, partial(self.signing.problem, asked))
        await self.app.push_screen(question, partial(self.later, dialogue.answered, asked))

    def _signed(self, passphrase: str, report: Any) -> None:
        """Go on from a certificate; the passphrase opens the next one of this shift."""
        self.bench_app.shift.keep(self.session.operator, passphrase)
        self.later(dialogue.signed, report)

    def _what_is_signed(self) -> Text:
        """Return the verdict, what is open in it, and in which role it is signed."""
        d, words = self.dialogue, Text("You sign as technician: ")
        if d.facts.result is not None:
            words.append(d.facts.result.word.upper(), signs.UNITS[d.facts.result.word].bold)
            words.append("".join(f"; {open_words}" for open_words in d.open_words))
        held = held_words(d.facts.nonconformances)
        return words.append_text(Text("\n").append_text(held)) if held else words

    async def draw(self) -> None:
        d = self.dialogue
        if d.failed:
            self.query_one("#verdict", Static).update("not evaluated")
        if d.facts.result is None:
            return
        if d.facts.result is not self._shown:
            self._shown = d.facts.result
            self._show_result(d.facts.result)
        self.query_one("#certificate", Static).update(d.certificate_words)
        if (d.row, d.detail) != self._told:
            self._told = d.row, d.detail
            self.query_one("#detail", Static).update(d.detail)
            self.query_one("#why", VerticalScroll).scroll_home(animate=False)
        self.call_after_refresh(self.refresh_bindings)  # PgDn is offered if it is longer than its room

    def _show_result(self, result: UnitRecord) -> None:
        d, table = self.dialogue, self.query_one(DataTable)
        sign = signs.UNITS[result.word]
        self.query_one(Banner).show(sign.word.partition(",")[0], sign.bold)  # a band has room for one word
        self.query_one("#verdict", Static).update(_verdict(d, result))
        table.visible = True
        table.clear()
        for f in d.findings:
            status = d.status(f)
            value = numbers(f.value, f.U, f.unit) if f.value is not None else "-"
            bounds = f"{limits(f.lower, f.upper)}{after_number(f.unit)}"
            cells = (
                *(f"{words} " for words in (label_of(f.quantity), value, bounds)),
                Text("pass, held" if status is Status.HELD else status.word, status.style),
            )
            table.add_row(Text(f" {status.mark} ", status.style), *cells)
        table.move_cursor(row=d.worst)

    async def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        await self.answer(dialogue.marked, event.cursor_row)

    def on_resize(self) -> None:
        self.call_after_refresh(self.refresh_bindings)

    def action_page(self, way: int) -> None:
        why = self.query_one("#why", VerticalScroll)
        why.scroll_relative(y=way * max(1, why.size.height - 1), animate=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave keys of a training out of the footer elsewhere, and one that has nothing more to show."""
        if action == "page":
            return any(why.max_scroll_y > 0 for why in self.query("#why"))
        return parameters != ("ctrl+r",) or self.bench.training is not None

    def help_text(self) -> str:
        return (
            "This is the result of all stored entries. F2 signs the certificate with the technician's passphrase, F3 "
            "countersigns with the passphrase of quality assurance. The technician's passphrase opens the key for a "
            "shift; Ctrl+L locks it. Each signature is verified from the file on disk. "
            "If you change anything, sign again."
        )


def _verdict(d: SummaryDialogue, result: UnitRecord) -> Text:
    """Return the verdict, what is open, and on lines of their own what to do first."""
    sign, held = signs.UNITS[result.word], result.nonconformances
    text = Text.assemble((f" {sign.word.upper()} ", f"reverse {sign.bold}"))
    if held:
        text.append(f"  nonconformance at {where_held(held)}. QA decides (F3).", HELD)
    text.append("".join(f"  {words.replace('no result', _NO_RESULT)}" for words in d.open_words))
    return text.append("".join(f"\n → {words}" for words in d.todo), "bold yellow")
