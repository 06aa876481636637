"""The end of a unit: all findings, the verdict, what is missing; signed, countersigned, verified."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Label, Static

from accept.base.documents.results import UnitRecord, unit_word
from accept.certificate.trust import keys
from accept.certificate.trust.encrypted_key import LockedError
from accept.certificate.verify.verification import Validity, Verification
from accept.judging.advice import ADVICE, advice, first_advice
from accept.judging.nonconformance import CHOICES
from accept.pictures import signs
from accept.pictures.labels import label_of
from accept.store.event import shown_name
from accept.store.payloads import RecordRefused, without_hashes
from accept.tui.background.problems import words_of
from accept.tui.background.process_work import send_to_worker
from accept.tui.background.scanning import Scanning
from accept.tui.screens.ask import Check, Help, Question, QuestionLine
from accept.tui.screens.put_right import ask_remedy
from accept.tui.widgets.banner import Banner
from accept.tui.widgets.key_row import KeyRow
from accept.tui.widgets.limit_bar import after_number, limits, numbers
from accept.tui.widgets.step_list import HELD, UnitBar, held_words, listed, where_held
from accept.workflow import certify
from accept.workflow.bench import Workbench
from accept.workflow.session import Session
from accept.workflow.shift import SigningShift
from accept.workflow.status import Status, of_findings
from accept.workflow.steps.section import note_lines
from checks.acceptance import CHECKS
from checks.cause import Cause
from checks.verdict import RULES, Finding, UnitVerdict, Verdict
from specs.errors import AcceptError

SOUND = "ACCEPT_SOUND"  # 1: the result can be heard, one stroke of the bell if accepted, else three
_BETWEEN_BELLS_S = 0.4
_OUTCOMES = {
    Validity.VALID: "✓ verified",
    Validity.SIGNED: "◐ signed, not fully verified",
    Validity.NOT_VALID: "✗ NOT VALID",
}


class Summary(Scanning[bool]):
    """Judges the unit when it opens. Dismisses True for the next unit, False to go back to the steps."""

    asks_passphrase = True
    where_signed = "A passphrase: F2 first"

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "take_scan", show=False, priority=True),
        Binding("f2", "sign", "Sign", priority=True),
        Binding("f3", "countersign", "QA countersigns"),
        Binding("f4", "next", "Next unit"),
        Binding("ctrl+r", "put_right", "Put right"),
        Binding("ctrl+l", "lock", "Forget passphrase", show=False),
        Binding("pagedown", "page(1)", "More", priority=True),
        Binding("pageup", "page(-1)", show=False, priority=True),
        Binding("escape", "leave", "Back"),
    ]

    def __init__(self, bench: Workbench, session: Session) -> None:
        super().__init__()
        self.bench, self.session = bench, session
        self.report: Verification | None = None
        self._why: list[str] = []
        self._notes: list[str] = []
        self._held = False
        self._signs_then = False  # F2 came before the result

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

    def on_mount(self) -> None:
        if not self.alive:
            return
        table = self.query_one(DataTable)
        table.add_columns("", "Quantity ", "Value ± U ", "Limits ", "Verdict")
        table.visible = False  # its head alone says nothing
        if self.session.result is not None:
            self._judged(self.session.result)
        else:
            self._judge()

    def takes_scans(self) -> bool:
        """Return whether letters are a serial: before the result they may be a passphrase that is typed ahead."""
        return self.session.result is not None

    def _judge(self) -> None:
        judge = self.session.judge
        send_to_worker(
            self, self.bench.worker, lambda e: judge(e.judge), self._judged_now, "judging the unit", self._not_judged
        )

    def _judged_now(self, result: UnitRecord) -> None:
        """Show a new result; it can be heard too."""
        self._judged(result)
        if os.environ.get(SOUND, "").strip() == "1":
            for n in range(1 if result.verdict is UnitVerdict.ACCEPTED else 3):
                self.set_timer(n * _BETWEEN_BELLS_S + 0.01, self.app.bell)

    def _not_judged(self, _: str) -> None:
        self.query_one("#verdict", Static).update("not evaluated")

    def _judged(self, result: UnitRecord) -> None:
        """Show a result, and go on to sign it if F2 came before it."""
        self._show_result(result)
        if self.in_front:
            self._sign_then()

    def _sign_then(self) -> None:
        """Go on to sign, if F2 came before the result."""
        if self._signs_then:
            self._signs_then = False
            self.run_worker(self.action_sign(), group="sign")

    def _show_result(self, result: UnitRecord) -> None:
        sign = signs.UNITS[result.word]
        self.query_one(Banner).show(sign.word.partition(",")[0], sign.bold)  # a band has room for one word
        refused = {r.file: r for f in result.findings if (r := self.session.refusal(f)) is not None}
        verdict = _verdict(result, self._open_in(result), list(refused.values()))
        self.query_one("#verdict", Static).update(verdict)
        table = self.query_one(DataTable)
        table.visible = True
        table.clear()
        for f in result.findings:
            status = self._status(f, result)
            value = numbers(f.value, f.U, f.unit) if f.value is not None else "-"
            bounds = f"{limits(f.lower, f.upper)}{after_number(f.unit)}"
            cells = (
                *(f"{words} " for words in (label_of(f.quantity), value, bounds)),
                Text("pass, held" if status is Status.HELD else status.word, status.style),
            )
            table.add_row(Text(f" {status.mark} ", status.style), *cells)
        steps = [step.name for step in self.session.steps]
        people = {f"{name}: {line}" for name in steps for line in note_lines(self.session.state(name))}
        self._notes = [
            without_hashes(self._with_step(note)) for note in sorted(result.notes, key=lambda note: note not in people)
        ]
        self._held = bool(result.nonconformances)
        said = verdict.plain.partition("\n")[2]
        self._why = [_detail(f, self.session.refusal(f), said) for f in result.findings]
        worst = next((n for n, f in enumerate(result.findings) if f.verdict is not Verdict.PASS), 0)
        table.move_cursor(row=worst)
        self._tell(worst)
        self._show_certificate()
        signed = self.session.attempt.certificate is not None
        self.say("Signed. F3: countersign, F4: next unit" if signed else "F2: sign this result")

    def _status(self, f: Finding, result: UnitRecord) -> Status:
        """Return what became of a quantity, with what is told apart among those without a result."""
        if f.verdict is Verdict.PASS and result.nonconformances:
            return Status.HELD
        if self.session.refusal(f) is not None:
            return Status.REFUSED
        unmeasured = f.cause is not None and f.cause.cause is Cause.NOT_MEASURED and not f.cause.record
        return Status.NOT_DONE if unmeasured else of_findings([f])

    def _open_in(self, result: UnitRecord) -> list[str]:
        """Return what keeps a unit from being accepted, in words: quantities by what became of them."""
        words = {
            Status.FAIL: "failed",
            Status.NO_RESULT: "no result",
            Status.REFUSED: "record refused",
            Status.NOT_DONE: "not measured",
            Status.CONDITIONAL: "conditional",
        }
        found = [(self._status(f, result), label_of(f.quantity)) for f in result.findings]
        groups = {word: [label for own, label in found if own is status] for status, word in words.items()}
        return [f"{word}: {listed(labels)}" for word, labels in groups.items() if labels]

    def _with_step(self, note: str) -> str:
        """Return a note with the words of its step in place of the code name that it begins with."""
        name, colon, words = note.partition(": ")
        short = next((step.short for step in self.session.steps if step.name == name), name)
        return f"{short}{colon}{words}"

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        self._tell(event.cursor_row)

    def _tell(self, row: int) -> None:
        """Tell why a finding is what it is, and what was noted about the unit."""
        if 0 <= row < len(self._why):  # an empty table says row -1
            hold = ADVICE[Cause.NONCONFORMANCE] if self._held else ""
            hold = hold.removeprefix("sign; ") if self.session.attempt.certificate is not None else hold
            texts = list(filter(None, (self._why[row], hold and f"→ {hold}", *self._notes)))
            self.query_one("#detail", Static).update("\n".join(texts))
            self.query_one("#why", VerticalScroll).scroll_home(animate=False)
            self.call_after_refresh(self.refresh_bindings)  # PgDn is offered if it is longer than its room

    def on_resize(self) -> None:
        self.call_after_refresh(self.refresh_bindings)

    def action_page(self, way: int) -> None:
        why = self.query_one("#why", VerticalScroll)
        why.scroll_relative(y=way * max(1, why.size.height - 1), animate=False)

    def _show_certificate(self) -> None:
        attempt = self.session.attempt
        if attempt.certificate is None and attempt.void is not None:
            lacks = " and lacks the nonconformance" if self.session.nonconformances else ""
            words = (
                f"Certificate: not signed. ✗ {Path(attempt.void).name} is void: it is older than the last change{lacks}"
            )
            words += "\n→ Do not hand it out. F2: sign again, which replaces it"
        elif attempt.certificate is None:
            words = f"Certificate: not signed. Judged in the name of {shown_name(self.session.operator, typed=True)}"
        else:
            words = f"Certificate: {attempt.certificate}"
            if self.report is not None:  # it names who signed
                words = f"{_OUTCOMES[self.report.outcome]}: {self.report.reason}\n{words}"
            else:
                words += f"\nSigned by: {', '.join(f'{s.who} ({s.role})' for s in attempt.signatures)}"
        self.query_one("#certificate", Static).update(words)

    async def action_sign(self) -> None:
        """Ask what is needed to sign. Keys that follow wait for the question, so that no passphrase goes elsewhere."""
        if self.session.result is None:
            if self.idle:  # something was stored since: what is signed is what is shown
                self._judge()
            self._signs_then = True
            await self._ask_ahead()
        elif self.session.attempt.certificate is not None:
            self.say("Already signed. F3: countersign", "bad")
        elif problem := certify.key_problem(self.bench.home, keys.TECHNICIAN, self.session.operator):
            self.say(problem, "bad")
        elif (kept := self._shift.passphrase(self.session.operator)) is not None:
            words = self._what_is_signed().append(f"\n\n{_OPEN_KEY.format(self.session.operator)}", "not bold default")
            question = Question(f"Sign {self.session.serial}", words, self._asked_why, self._signs(lambda _: "", kept))
            await self.app.push_screen(question, lambda answer: self._sign(None if answer is None else [kept, *answer]))
        elif keys.exist(self.bench.home):
            lines = [*self._asked_why, QuestionLine("Passphrase", secret=True)]
            words = self._what_is_signed().append(f"\n\n{_FOR_A_SHIFT}", "not bold default")
            question = Question(f"Sign {self.session.serial}", words, lines, self._signs(self._opens(keys.TECHNICIAN)))
            await self.app.push_screen(question, lambda answer: self._sign(answer and answer[::-1]))
        else:
            words = self._what_is_signed().append(f"\n\n{_FIRST_KEYS}", "not bold default")
            lines, title = [*self._asked_why, *_FIRST_LINES], f"Sign {self.session.serial}: choose a passphrase"
            await self.app.push_screen(Question(title, words, lines, self._signs(self._can_be)), self._first_keys)

    @property
    def _asked_why(self) -> list[QuestionLine]:
        """Return the line that asks why a unit is signed that is not accepted, or a certificate is replaced."""
        result = self.session.result
        if result is None or (result.verdict is UnitVerdict.ACCEPTED and not certify.needs_why(self.session)):
            return []
        return [QuestionLine(_WHY_REPLACED if certify.needs_why(self.session) else _WHY)]

    def _signs(self, secret: Callable[[list[str]], str], kept: str = "") -> Check:
        """Return a check of the lines by which a technician signs: why, if that is asked, then the passphrase. secret:
        returns why the passphrase cannot be taken, from all lines so far; kept: one that is not asked for."""
        asked = len(self._asked_why)

        def check(place: int, given: list[str]) -> str:
            if place < asked:
                return certify.reason_problem(self.session, given[place], [kept, *given[asked:]])
            return secret(given[: place + 1])

        return check

    def _can_be(self, given: list[str]) -> str:
        """Return why a passphrase that is chosen cannot be taken: said at its first line."""
        said, chosen = given[: len(self._asked_why)], given[len(self._asked_why) :]
        differ = "The passphrases differ" if len(set(chosen)) > 1 else ""
        return certify.new_passphrase_problem(self.session, chosen[0], said) or differ

    async def _ask_ahead(self) -> None:
        """Ask for the passphrase while the unit is still evaluated; what is signed is confirmed when it is known."""
        operator = self.session.operator
        self.say("Evaluating; then you confirm what is signed")
        known = keys.exist(self.bench.home) and not certify.key_problem(self.bench.home, keys.TECHNICIAN, operator)
        if not known or self._shift.passphrase(operator) is not None:
            return

        def keep(answer: list[str] | None) -> None:
            if answer is None:
                self._signs_then = False
                return
            self._shift.keep(operator, answer[0])
            if self.session.result is not None:
                self._sign_then()

        words = f"Nothing is signed yet: once the unit is evaluated you confirm what is signed.\n\n{_FOR_A_SHIFT}"
        lines = [QuestionLine("Passphrase", secret=True)]
        opens = self._opens(keys.TECHNICIAN)
        question = Question(f"Sign {self.session.serial}", words, lines, lambda _, given: opens(given))
        await self.app.push_screen(question, keep)

    def _what_is_signed(self) -> Text:
        """Return the verdict, what is open in it, and in which role it is signed."""
        result = self.session.result
        words = Text("You sign as technician: ")
        if result is not None:
            words.append(result.word.upper(), signs.UNITS[result.word].bold)
            words.append("".join(f"; {open_words}" for open_words in self._open_in(result)))
        held = held_words(self.session.nonconformances)
        return words.append_text(Text("\n").append_text(held)) if held else words

    def _opens(self, role: str) -> Callable[[list[str]], str]:
        """Return a check of the last of the lines so far: whether it opens the key of a role."""

        def check(given: list[str]) -> str:
            try:
                certify.check_passphrase(self.session, role, given[-1])
            except AcceptError as e:
                return _NOT_OPENED if isinstance(e.__cause__, LockedError) else words_of(e)
            return ""

        return check

    def _first_keys(self, answer: list[str] | None) -> None:
        if answer is None:
            return
        *reason, first, _ = answer
        home, operator = self.bench.home, self.session.operator
        self.send(
            lambda: certify.make_keys(home, operator, first),
            lambda left: self._made([first, *reason], left),
            "making keys",
        )

    def _made(self, answer: list[str], left: Path) -> None:
        """Sign with new keys. answer: the passphrase, and the reason if one was asked."""
        self.say("Keys were created", "good")
        if self.bench.training is not None:  # the authority of a training has no owner
            self._sign(answer)
            return
        self.app.push_screen(Help("Keys were created", _OFF_THE_BENCH.format(left)), lambda _: self._sign(answer))

    def _sign(self, answer: list[str] | None) -> None:
        """Sign the unit. answer: the passphrase, and the reason if one was asked."""
        if answer is not None:
            self.send(
                lambda: certify.sign_unit(self.session, *answer),
                lambda report: self._signed(report, answer[0]),
                "signing and verifying",
            )

    @property
    def _shift(self) -> SigningShift:
        return self.bench_app.shift

    def action_lock(self) -> None:
        """Forget the passphrase before the shift is over."""
        self.say("The passphrase is forgotten" if self._shift.lock() else "No passphrase is kept")

    def action_countersign(self) -> None:
        if self.session.attempt.certificate is None:
            self.say("The technician must sign first: F2", "bad")
        elif len(self.session.attempt.signatures) > 1:
            self.say("Already countersigned", "bad")
        elif problem := certify.key_problem(self.bench.home, keys.QA, self.session.operator):
            self.say(problem, "bad")
        else:
            self.app.push_screen(self._asked_of_qa(), self._countersign)

    def _asked_of_qa(self) -> Question:
        """Return the passphrase, and for a unit that was not accepted what is to be done with it."""
        verdict, held = str(self.session.attempt.verdict), self.session.nonconformances
        words, lines = "As quality assurance, with the QA key's own passphrase.", []
        if verdict != UnitVerdict.ACCEPTED:
            word = unit_word(verdict, held)
            words = f"The unit is {word}. Decide what is to be done with it:\n{', '.join(CHOICES)}."
            lines = [QuestionLine("Disposition"), QuestionLine("Reason")]
        lines.append(QuestionLine("QA passphrase", secret=True))
        opens = self._opens(keys.QA)

        def check(place: int, given: list[str]) -> str:
            if place + 1 == len(lines):
                return opens(given)
            choice, reason, passphrase = given
            return certify.disposition_problem(self.session, choice, reason if place else "-", [passphrase])

        return Question(f"Countersign {self.session.serial}", words, lines, check)

    def _countersign(self, answer: list[str] | None) -> None:
        if answer is not None:
            *disposition, passphrase = answer
            self.send(
                lambda: certify.countersign_unit(self.session, passphrase, *disposition),
                self._signed,
                "countersigning and verifying",
            )

    def _signed(self, report: Verification, passphrase: str = "") -> None:
        """Show a signed certificate. passphrase: of the technician, which opens the next one of this shift."""
        if passphrase:
            self._shift.keep(self.session.operator, passphrase)
        self.report = report
        self._show_certificate()
        self._tell(self.query_one(DataTable).cursor_row)
        if report.valid:
            self.say("Signed and verified. F4: next unit", "good")
        elif report.outcome is Validity.SIGNED:
            self.say(f"Signed, not fully verified: {report.reason}", "bad")
        else:
            self.say(f"The certificate does not verify: {report.reason}", "bad")
        if self.bench.training is not None and not report.countersigned:
            told = Help("Training: what this unit had", self.bench.training.hidden, "next unit")
            self.app.push_screen(told, lambda further: self.action_next() if further else None)

    def check_action(self, action: str, _: tuple[object, ...]) -> bool | None:
        """Leave keys of a training out of the footer elsewhere, and one that has nothing more to show."""
        if action == "page":
            return any(why.max_scroll_y > 0 for why in self.query("#why"))
        return action != "put_right" or self.bench.training is not None

    def action_put_right(self) -> None:
        ask_remedy(self, self.bench, self.session, lambda _: self.leave(False))

    def action_next(self) -> None:
        self.leave(True)

    def action_leave(self) -> None:
        self.stop_or(lambda: self.leave(False))

    def help_text(self) -> str:
        return (
            "This is the result of all stored entries. F2 signs the certificate with the technician's passphrase, F3 "
            "countersigns with the passphrase of quality assurance. The technician's passphrase opens the key for a "
            "shift; Ctrl+L locks it. Each signature is verified from the file on disk. "
            "If you change anything, sign again."
        )


_FIRST_KEYS = (
    "Choose your passphrase: 8 characters or more. The bench's authority and your key as technician are created now. A "
    "forgotten passphrase cannot be recovered."
)
_OFF_THE_BENCH = (
    "The passphrase of the bench's authority is in {}. Move that file and ca.key.pem beside it off the bench: a person "
    "who has both can give keys to anybody. Quality assurance gets a key of its own with: "
    "accept keys request --role qa --name NAME"
)
_NOT_OPENED = "Wrong passphrase, or the file of the key is damaged. Type it again"
_WHY = "Why it is signed so (on the certificate)"
_WHY_REPLACED = "Why its certificate is replaced (on the certificate)"
_FOR_A_SHIFT = "It opens your key for this shift. Forgotten after 15 min without a key, or at once: Ctrl+L."
_OPEN_KEY = "The key of {} is open. Enter: sign. Not you? Esc, then Ctrl+L locks it."
_FIRST_LINES = [
    QuestionLine("Passphrase", secret=True),
    QuestionLine("Repeat passphrase", secret=True),
]


def _detail(f: Finding, refused: RecordRefused | None, said: str) -> str:
    """Return why a finding is what it is, and what to do about it unless it was said. refused: the record that it
    lacks; said: what stands below the verdict."""
    why = f.reason or f.note or f"passes if {RULES[str(f.rule)]}"
    why, todo = (why, advice(CHECKS[f.check], f)) if refused is None else (refused.line, [refused.action])
    return "\n".join([f"{label_of(f.quantity)}: {why}", *(f"→ {line}" for line in todo if line not in said)])


_NO_RESULT = "no\N{NO-BREAK SPACE}result"  # not broken at the end of a line


def _verdict(result: UnitRecord, open_words: Sequence[str], refused: Sequence[RecordRefused]) -> Text:
    """Return the verdict, what is open, and on lines of their own what to do first. refused: records that lack."""
    sign = signs.UNITS[result.word]
    text = Text.assemble((f" {sign.word.upper()} ", f"reverse {sign.bold}"))
    if result.nonconformances:
        text.append(f"  nonconformance at {where_held(result.nonconformances)}. QA decides (F3).", HELD)
    text.append("".join(f"  {words.replace('no result', _NO_RESULT)}" for words in open_words))
    todo = [f"{record.file}: {record.action}" for record in refused]
    if (told := first_advice(result.findings)) is not None:
        todo.append(told)
    return text.append("".join(f"\n → {words}" for words in todo), "bold yellow")
