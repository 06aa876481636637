"""The end of a unit: renders its dialogue, passes on keys and executes effects; what they mean is decided there."""

import asyncio
import math
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import DataTable, Label, Static

from accept.base.documents.results import UnitRecord
from accept.pictures import signs
from accept.pictures.labels import label_of
from accept.pictures.words import pretty
from accept.tui.background.busy_screen import Then, after
from accept.tui.background.scanning import Scanning
from accept.tui.background.viewer import open_file, viewer
from accept.tui.screens.ask import Choice, Help, Question, QuestionLine
from accept.tui.screens.put_right import ask_remedy
from accept.tui.widgets.banner import Banner
from accept.tui.widgets.card import Card, chip
from accept.tui.widgets.findings import note_line
from accept.tui.widgets.hanging import Hanging
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.limit_bar import LimitBar, after_number, blocks, limits, numbers, usual_words
from accept.tui.widgets.pictures import first_pictures, show_in
from accept.tui.widgets.plot import has_room
from accept.tui.widgets.step_list import HELD, WIDE_FROM, UnitBar, held_words, where_held
from accept.workflow.bench import Workbench
from accept.workflow.dialogue import summary as dialogue
from accept.workflow.dialogue import summary_effects as effects
from accept.workflow.dialogue.summary_effects import Do
from accept.workflow.dialogue.summary_state import SummaryDialogue, Turn
from accept.workflow.effects.serve_summary import facts
from accept.workflow.session import Session
from accept.workflow.steps.status import Status
from checks.verdict import Finding, Verdict

SOUND = "ACCEPT_SOUND"  # 1: the result can be heard, one stroke of the bell if accepted, else three
_BETWEEN_BELLS_S = 0.4
_NO_RESULT = "no\N{NO-BREAK SPACE}result"  # not broken at the end of a line
_LIMITS = "Limits"
_COLUMNS = "", "Quantity", "Value ± U", _LIMITS, "Verdict"
_SHORTEST_GAUGE, _LONGEST_GAUGE = 6, 80
_MARK = 3  # columns of the marks
_PICTURES = 6  # beside and below each other


class Summary(Scanning):
    """Judges the unit when it opens. Dismisses True for the next unit, False to go back to the steps."""

    asks_passphrase = True
    where_signed = "A passphrase: ^S first"
    press = staticmethod(dialogue.press)

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "take_scan", show=False, priority=True),
        Binding("ctrl+s", "press('ctrl+s')", "Sign", priority=True),
        Binding("ctrl+t", "press('ctrl+t')", "QA countersigns"),
        Binding("f10", "press('f10')", "Next unit", priority=True),
        Binding("f8", "press('f8')", "Again"),
        Binding("ctrl+e", "press('ctrl+e')", "Open the page"),
        # what these were called before they meant the same on every screen
        Binding("f2", "press('ctrl+s')", show=False, priority=True),
        Binding("f3", "press('ctrl+t')", show=False),
        Binding("f4", "press('f10')", show=False, priority=True),
        Binding("ctrl+r", "press('ctrl+r')", "Repair"),
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
        self._signs = False  # a signature is under way

    def compose(self) -> ComposeResult:
        yield UnitBar(self.session, "summary")
        with Horizontal(id="top"):
            yield Banner()
            yield Hanging("Evaluating …", id="verdict")
        with Horizontal(id="whole"):
            with Vertical(id="judged"):
                with Card(title="Findings", id="found", fit=self._fit):
                    yield DataTable(id="findings", cursor_type="row", cell_padding=0)
                    with VerticalScroll(id="why", can_focus=False):
                        yield Static("", id="detail", markup=False)
                yield Vertical(id="drawn", classes="nothing")
                with VerticalScroll(id="noted", classes="card", can_focus=False):
                    yield Static("", id="typed", markup=False)
            with Vertical(id="signed"):
                with Card(title="Sign", id="sign"):
                    yield Static("", id="who", markup=False)
                with Card(title="Certificate", id="paper"):
                    yield Static("", id="ticks", markup=False)
                    yield Static("", id="certificate", markup=False)
        yield Label("", id="status")
        yield KeyRow()

    async def on_mount(self) -> None:
        self.query_one("#noted").border_title = "Notes"
        if self.alive:
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
            case Do.OPEN_PAGE:
                await self._open_page(Path(str(self.dialogue.facts.certificate)))
            case Do.ASK_REMEDY:
                ask_remedy(self, lambda _: self.leave(False))
            case Do.TELL_HIDDEN if (unit := self.bench.training) is not None:
                if choices := unit.choices:
                    words = "Guess before it is told."
                    asked = Choice("Training: what is wrong with this unit?", words, choices, "tell me")
                    self.app.push_screen(
                        asked, lambda n: self._tell_hidden("" if n is None else f"{unit.guess(n)}\n\n")
                    )
                else:
                    self._tell_hidden("")
            case Do.RING if os.environ.get(SOUND, "").strip() == "1":
                for n in range(1 if self.dialogue.accepted else 3):
                    self.set_timer(n * _BETWEEN_BELLS_S + 0.01, self.app.bell)
            case effects.LookForKeys(role):
                keys = replace(self.signing.keys(role), kept=shift.passphrase(operator) is not None)
                await self.answer(dialogue.keys_found, effect, keys)
            case effects.Ask():
                await self._ask(effect)
            case effects.KeepPassphrase(passphrase):
                shift.keep(operator, passphrase)
            case effects.SignAsTechnician(passphrase) if effect.makes_keys:
                self.send(
                    lambda: self.signing.make_keys(passphrase),
                    lambda left: self.later(dialogue.keys_made, effect, str(left)),
                    "making keys",
                )
            case effects.SignAsTechnician(first=first) if first:
                told = Help("Keys were created", first)
                self.app.push_screen(told, lambda _: self.call_next(self.execute, replace(effect, first="")))
            case effects.SignAsTechnician(typed, reason):
                opens = typed or shift.passphrase(operator)
                if opens is None:  # the bench was left while the question stood
                    await self.answer(dialogue.press, "ctrl+s")
                    return
                self._begin_signing(lambda: self.signing.sign(opens, reason), partial(self._signed, opens), "signing")
            case effects.Countersign(passphrase, choice, reason):
                self._begin_signing(
                    lambda: self.signing.countersign(passphrase, choice, reason),
                    partial(self.later, dialogue.signed),
                    "countersigning",
                )

    def _tell_hidden(self, guessed: str) -> None:
        """Tell what was wrong with the unit of a training. guessed: what became of the guess."""
        if self.bench.training is not None:
            told = Help("Training: what this unit had", f"{guessed}{self.bench.training.hidden}", "next unit")
            self.app.push_screen(told, lambda further: self.leave(True) if further else None)

    async def _open_page(self, path: Path) -> None:
        """Show the certificate: in a tab of the browser, in the viewer of this desktop, else say its path."""
        command = viewer()
        try:
            if self.app.is_web:
                page = BytesIO(await asyncio.to_thread(path.read_bytes))
                mime = "application/pdf"
                self.app.deliver_binary(page, save_filename=path.name, open_method="browser", mime_type=mime)
            elif command:
                open_file(command, path)
            self.say(f"Opened {path}" if command or self.app.is_web else f"No viewer here. The certificate is {path}")
        except OSError as e:
            self.say(f"{path}: {e.strerror or e}", "bad")

    def _begin_signing(self, sign: Callable[[], Any], then: Then, doing: str) -> None:
        self._mark_signing(True)
        ended = partial(self._mark_signing, False)
        self.send(sign, after(ended, then), f"{doing} and verifying", after(ended, None))

    def _mark_signing(self, under_way: bool) -> None:
        self._signs = under_way
        self._show_ticks()

    def _show_ticks(self) -> None:
        between = "\n" if self.app.size.width >= WIDE_FROM else "   "
        for ticks in self.query("#ticks").results(Static):
            ticks.update(_ticks(self.dialogue, self._signs, between))

    async def _ask(self, asked: effects.Ask) -> None:
        """Ask; keys that follow wait for the question, so that no passphrase goes elsewhere."""
        words = self._what_is_signed().append(f"\n\n{asked.words}", "not bold default") if asked.states else asked.words
        lines = [QuestionLine(line.value, secret=line.is_secret) for line in asked.lines]
        question = Question(asked.title, words, lines, partial(self.signing.problem, asked))
        question.beside(self.query_one("#signed").region.y)
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
            self.query_one("#verdict", Hanging).hang(Text("Not evaluated. F8: evaluate again, Esc: back to the steps"))
        self.query_one("#who", Static).update(_sign_words(d))
        self.query_one("#sign").set_class(d.facts.certificate is None and d.facts.result is not None, "todo")
        self.call_after_refresh(self.refresh_bindings)  # PgDn is offered if something is longer than its room
        if d.facts.result is None:
            return
        if d.facts.result is not self._shown:
            self._shown = d.facts.result
            self._show_result(d.facts.result)
        self._show_ticks()
        words, page = d.certificate_words, d.facts.certificate
        if page is not None:
            within = folded(f"in {Path(page).parent}", self.query_one("#paper").size.width)
            fits = self.app.size.width < WIDE_FROM and len(f"Certificate: {page}") <= self.size.width
            words = words if fits else words.replace(str(page), f"{Path(page).name}\n{within}")
            words += "\n^E: open it"
        self.query_one("#certificate", Static).update(words)
        if (d.row, d.detail) != self._told:
            self._told = d.row, d.detail
            self.query_one("#detail", Static).update(_detail(d))
            self.query_one("#why", VerticalScroll).scroll_home(animate=False)

    def _show_result(self, result: UnitRecord) -> None:
        d, sign = self.dialogue, signs.UNITS[result.word]
        self.query_one(Banner).show(sign.word.partition(",")[0], sign.bold)  # letters have room for one word
        self.query_one("#top").set_classes(sign.tone.name.lower())
        self.query_one("#verdict", Hanging).hang(_verdict(d, result))
        passed = sum(f.verdict is Verdict.PASS for f in d.findings)
        self.query_one("#found").border_subtitle = f"{passed} of {len(d.findings)} pass"
        notes = self.query_one("#noted")
        notes.display, notes.border_subtitle = bool(d.notes), f"{len(d.notes)}, on the certificate"
        self.query_one("#typed", Static).update(note_line("\n".join(d.notes)))
        self._show_table(d.worst)
        self.call_later(self._show_pictures)

    async def _show_pictures(self) -> None:
        """Show pictures of the unit below the table if there is room."""
        panels = first_pictures(self.session, _PICTURES) if has_room(self.app.size) else ()
        holder = self.query_one("#drawn", Vertical)
        holder.set_class(not panels, "nothing")
        holder.styles.grid_size_columns = math.ceil(len(panels) / 2) if len(panels) > 3 else max(1, len(panels))
        await show_in(holder, panels)

    def _show_table(self, row: int) -> None:
        d, table = self.dialogue, self.query_one(DataTable)
        labels = [label_of(f.quantity) for f in d.findings]
        values = aligned([_value_words(f) for f in d.findings])
        words = ["pass, held" if (status := d.status(f)) is Status.HELD else status.word for f in d.findings]
        texts = zip(_COLUMNS[1:3], (labels, values), strict=True)
        taken = [_MARK, *(max(map(len, (title, *column))) + 2 for title, column in texts)]
        room = self.query_one("#found").size.width - sum(taken) - 3  # the table has none before its first row
        room -= table.styles.scrollbar_size_vertical if self.app.size.width < WIDE_FROM else 0  # of rows
        said = max(map(len, (_COLUMNS[-1], *words)))
        gauge = min(_LONGEST_GAUGE, room - said)
        drawn = gauge >= _SHORTEST_GAUGE  # else the limits below say it, of the row under the cursor
        table.clear(columns=True)
        for title, width in zip(_COLUMNS, (*taken, gauge + 2, said), strict=True):
            if drawn or title != _LIMITS:
                table.add_column(title, width=width)  # a width of its own would be measured after it is drawn once
        for f, label, value, word in zip(d.findings, labels, values, words, strict=True):
            status = d.status(f)
            bar = LimitBar(f.lower, f.upper, max(gauge, 1), f.value)
            usual = d.facts.usual.get(f.quantity)
            table.add_row(
                Text(f" {status.mark} ", status.style),
                f"{label}  ",
                Text(f"{value}  ", "bold"),
                *([bar.drawn(status.style, f.U, usual).append("  ", status.style)] if drawn else []),
                Text(word, status.style),
            )
        table.move_cursor(row=row)

    async def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        await self.answer(dialogue.marked, event.cursor_row)

    def _fit(self) -> None:
        """Show the result in another room: gauges are as wide as there is."""
        if self._shown is not None:
            self._show_table(max(0, self.dialogue.row))
            self.call_later(self._show_pictures)
        self.call_after_refresh(self.refresh_bindings)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave keys of a training out of the footer elsewhere, and one that has nothing more to show."""
        if action == "page":
            return any(part.max_scroll_y > 0 for part in self.query(VerticalScroll))
        return parameters != ("ctrl+r",) or self.bench.training is not None

    @property
    def main_key(self) -> str:
        """Return the key of what is to be done next."""
        signed = self.dialogue.facts.certificate is not None and not self._signs  # and verified
        return "f8" if self.dialogue.failed else "f10" if signed else "ctrl+s"

    def help_text(self) -> str:
        return (
            "This is the result of all stored entries. ^S signs the certificate with the technician's passphrase, ^T "
            "countersigns with the passphrase of quality assurance. The technician's passphrase opens the key for a "
            "shift; Ctrl+L locks it. Each signature is verified from the file on disk. "
            "If you change anything, sign again."
        )


def _verdict(d: SummaryDialogue, result: UnitRecord) -> Text:
    """Return what is open, and on lines of their own what to do first; the word stands in large letters beside it."""
    held, text = result.nonconformances, Text()
    if held:
        text.append(f"HELD: nonconformance at {where_held(held)}. QA decides (^T).", HELD)
    opens = "   ".join(words.replace("no result", _NO_RESULT) for words in d.open_words)
    text.append(f"{'   ' if held and opens else ''}{opens}")
    if not text and d.accepted:
        text.append(f"All {len(d.findings)} quantities pass", "bold")
    if (closest := d.closest) and d.accepted:
        text.append(f"\n{closest}", "not bold")
    return text.append("".join(f"\n→ {words}" for words in d.todo), "bold yellow")


def _detail(d: SummaryDialogue) -> Text:
    """Return what is known about the finding under the cursor; its limits first, and the last units at the end."""
    if not 0 <= d.row < len(d.findings):
        return Text()
    f, earlier = d.findings[d.row], d.facts.earlier.get(d.findings[d.row].quantity, ())
    text = Text(f"{limits(f.lower, f.upper, f.unit)}   ", "bold")
    text.append(pretty(d.detail), "not bold default")
    if earlier:
        bars = blocks(earlier[::-1], len(earlier))
        text.append(f"\nlast {len(earlier)} units {bars}{usual_words(d.facts.usual.get(f.quantity))}", "not bold dim")
    return text


def _value_words(f: Finding) -> str:
    """Return a value with its U, even if that is unknown."""
    if f.value is None:
        return "-"
    return numbers(f.value, f.U, f.unit) if f.U is not None else f"{f.value:.4g} ± ?{after_number(f.unit)}"


def folded(path: str, width: int) -> str:
    """Return a path in lines that end between its folders, as far as these fit."""
    lines = [""]
    for part in re.findall(r"[^/]*/?", path):
        if lines[-1] and len(lines[-1]) + len(part) > width:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def aligned(values: Sequence[str]) -> list[str]:
    """Return values with U below each other at their sign."""
    parts = [value.partition(" ± " if " ± " in value else " ") for value in values]
    before, behind = (max((len(part[n]) for part in parts), default=0) for n in (0, 2))
    return [f"{number:>{before}}{sign:<3}{U}".ljust(before + 3 + behind) for number, sign, U in parts]


def _sign_words(d: SummaryDialogue) -> Text:
    """Return who signs which verdict, and the questions before the signature in their order."""
    facts, text = d.facts, Text(d.facts.operator, "bold")
    if facts.result is None:
        return text
    sign = signs.UNITS[facts.result.word]
    text.append("  ").append(f"{facts.serial} {sign.word.upper()}", sign.bold)
    if facts.certificate is None:
        why = "" if d.accepted else "why (it stands on the certificate), then "
        text.append(f"\nAsked: {why}your passphrase, once a shift", "not bold default")
        text.append("\n\n").append_text(chip("^S Sign and verify", "ctrl+s"))
        return text.append("\n\nQA countersigns afterwards: ^T", "dim")
    text.append("".join(f"\n ✓ {s.who}, {s.role}" for s in facts.signatures), "not bold default")
    if d.awaits_qa:
        words = "QA countersigns" if d.accepted else "QA decides about it; set it aside"
        text.append("\n\n").append_text(chip("^T", "ctrl+t", "bold")).append(words, "not bold default")
    return text.append("\n\n").append_text(chip("F10 next unit", "f10", "bold"))


def _ticks(d: SummaryDialogue, under_way: bool, between: str) -> Text:
    """Return the steps of the certificate, each with its mark. under_way: it is signed at this moment."""
    text, waits = Text(), under_way
    for n, (words, done) in enumerate(d.certificate_steps):
        mark, style = {True: ("✓", "green"), False: ("✗", "bold red"), None: ("○", "dim")}[done]
        if done is None and waits:
            mark, style, waits = "◉", "bold bright_blue", False
        text.append(between if n else "").append(f"{mark} {words}", style)
    return text
