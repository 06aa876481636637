"""The dialogue at the summary: it signs what is shown, asks for what is needed and for nothing else, and keeps no
passphrase."""

from dataclasses import dataclass, replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from accept.base.documents.results import UnitRecord, typed_note
from accept.judging.advice import ADVICE
from accept.store.folding import Signature
from accept.store.payloads import CHOICES, RecordRefused
from accept.workflow.dialogue import summary as dialogue
from accept.workflow.dialogue.summary import QA, TECHNICIAN
from accept.workflow.dialogue.summary_effects import (
    Ask,
    AskedLine,
    BenchKeys,
    Countersign,
    Do,
    KeepPassphrase,
    LookForKeys,
    SignAsTechnician,
)
from accept.workflow.dialogue.summary_state import SummaryDialogue, SummaryFacts, Turn
from accept.workflow.steps.status import Status
from checks.cause import Cause, Reason
from checks.verdict import Finding, UnitVerdict, Verdict
from tests.soak import SOAK

SECRET = "correct horse"
WHY = "for quality assurance"
PATH = "certificates/APA-02.pdf"


@dataclass(frozen=True)
class Report:
    outcome: str = "valid"
    reason: str = "APA-02 accepted"
    countersigned: bool = False


def finding(check: str, quantity: str, verdict: Verdict = Verdict.PASS, **named: object) -> Finding:
    return Finding(check, quantity, 1.7, "N/um", 0.1, 1.6, 1.9, "shared", verdict, None, None, **named)


STIFF, STROKE = finding("stiffness", "k_N_per_um"), finding("stroke", "stroke_um")
FAILS = replace(STROKE, verdict=Verdict.FAIL, reason="below its limit")
MISSING = Reason(Cause.NOT_MEASURED)


def result(*findings: Finding, verdict: UnitVerdict = UnitVerdict.ACCEPTED, **named: object) -> UnitRecord:
    return UnitRecord(serial="APA-02", kind="apa", verdict=verdict, findings=findings or (STIFF, STROKE), **named)


ACCEPTED = SummaryFacts("APA-02", "Ann", result(), steps={"stroke": "Stroke"}, verdict="accepted")
REJECTED = replace(ACCEPTED, result=result(STIFF, FAILS, verdict=UnitVerdict.REJECTED), verdict="rejected")
OPEN = replace(ACCEPTED, result=None, verdict="None")
ANN = Signature("Ann", TECHNICIAN, "2026-11-27T08:00:00Z")
SIGNED = replace(ACCEPTED, certificate=PATH, signatures=(ANN,))


def press(facts: SummaryFacts, key: str) -> Turn:
    return dialogue.press(SummaryDialogue(facts), key)


def asked(facts: SummaryFacts, keys: BenchKeys, role: str = TECHNICIAN) -> Ask:
    (ask,) = dialogue.keys_found(SummaryDialogue(facts), LookForKeys(role), keys).effects
    return ask


class TestResult:
    def test_a_unit_without_a_result_is_judged_and_one_with_a_result_is_shown(self):
        assert dialogue.opening(OPEN).effects == (Do.JUDGE,)
        shown = dialogue.opening(ACCEPTED)
        assert (shown.effects, shown.words.text) == ((), "^S: sign this result")
        assert dialogue.opening(SIGNED).words.text == "Signed. ^T: countersign, F10: next unit"

    def test_a_new_result_can_be_heard(self):
        judged = dialogue.judged(SummaryDialogue(REJECTED))
        assert (judged.effects, judged.words.text) == ((Do.RING,), "^S: sign this result")

    def test_the_cursor_stands_at_the_first_finding_that_is_no_pass_and_tells_why(self):
        d = dialogue.judged(SummaryDialogue(REJECTED)).state
        assert d.row == 1
        assert "Stroke, three stacks: below its limit" in d.detail
        assert "passes if" in dialogue.marked(d, 0).state.detail
        assert dialogue.marked(d, -1).state == d  # of an empty table
        assert dialogue.marked(d, 7).state.detail == ""

    def test_what_is_open_is_said_by_what_became_of_it(self):
        missing = replace(STROKE, verdict=Verdict.NO_RESULT, value=None, cause=MISSING)
        d = SummaryDialogue(replace(ACCEPTED, result=result(replace(STIFF, verdict=Verdict.FAIL), missing)))
        assert d.open_words == ["failed: K", "not measured: Stroke, three stacks"]
        refused = RecordRefused("stroke", "records", "one", "a.mat", "/r/a.mat", 0.0, MISSING, "record again")
        d = replace(d, facts=replace(d.facts, refused={"stroke_um": refused}))
        assert d.status(missing) is Status.REFUSED
        assert d.open_words[1] == "record refused: Stroke, three stacks"
        assert d.todo[0] == "a.mat: record again"
        assert "a.mat refused: " in dialogue.marked(d, 1).state.detail
        assert "→ record again" not in dialogue.marked(d, 1).state.detail  # it stands below the verdict

    def test_a_nonconformance_holds_what_passes_and_says_what_to_do(self):
        held = result(verdict=UnitVerdict.CONDITIONAL, nonconformances=("stroke: cracked",), notes=("stroke: cracked",))
        d = SummaryDialogue(replace(ACCEPTED, result=held, nonconformances=held.nonconformances))
        assert d.status(STIFF) is Status.HELD
        assert f"→ {ADVICE[Cause.NONCONFORMANCE]}" in d.detail
        assert d.notes == ["Stroke: cracked"]
        signed = replace(d, facts=replace(d.facts, certificate=PATH))
        assert "→ sign; " not in signed.detail

    def test_notes_of_people_come_first(self):
        facts = replace(ACCEPTED, result=result(notes=("stroke: of the program", typed_note("stroke", "ours"))))
        shown = ['Stroke: typed note: "ours"', "Stroke: of the program"]
        assert SummaryDialogue(facts).notes == shown
        assert SummaryDialogue(OPEN).notes == []

    def test_what_asks_for_a_finding_and_what_measured_it_stands_behind_its_reason(self):
        facts = replace(ACCEPTED, about={"k_N_per_um": ("limits: REQ-07", "LCR no. 1, calibrated until 2027-03-14")})
        lines = dialogue.marked(SummaryDialogue(facts), 0).state.detail.splitlines()
        assert "passes if" in lines[0]
        assert lines[1:] == ["limits: REQ-07", "LCR no. 1, calibrated until 2027-03-14"]
        assert len(dialogue.marked(SummaryDialogue(facts), 1).state.detail.splitlines()) == 1  # of another quantity

    def test_the_quantity_closest_to_a_limit_is_named_with_how_far_that_is(self):
        near = replace(STROKE, value=1.66)  # a fifth of 1.6 to 1.9
        assert SummaryDialogue(replace(ACCEPTED, result=result(STIFF, near))).closest == (
            "closest to a limit: Stroke, three stacks, 20% of its zone away"
        )
        one_sided = replace(STROKE, upper=None)
        assert SummaryDialogue(replace(ACCEPTED, result=result(one_sided))).closest == ""
        assert SummaryDialogue(replace(ACCEPTED, result=result(replace(STROKE, value=1.5)))).closest == ""  # outside

    def test_what_was_stopped_is_judged_again_and_what_is_judged_is_not(self):
        """Red before: the screen stayed empty, and nothing on it named a key that went on."""
        failed = dialogue.not_judged(SummaryDialogue(OPEN)).state
        again = dialogue.press(failed, "f8")
        assert (again.effects, again.state.failed) == ((Do.JUDGE,), False)
        assert dialogue.press(replace(failed, facts=replace(OPEN, idle=False)), "f8").effects == ()
        assert press(ACCEPTED, "f8").effects == ()

    def test_a_judgement_that_failed_is_not_called_a_result(self):
        failed = dialogue.not_judged(SummaryDialogue(OPEN))
        assert failed.state.failed
        assert failed.words is None  # the foot has the reason
        assert not dialogue.judged(replace(failed.state, facts=ACCEPTED)).state.failed


class TestCertificate:
    def test_it_is_not_signed_signed_or_verified(self):
        assert (
            SummaryDialogue(ACCEPTED).certificate_words == "Certificate: not signed. Judged in the name of Ann (typed)"
        )
        assert SummaryDialogue(SIGNED).certificate_words == f"Certificate: {PATH}\nSigned by: Ann (technician)"
        verified = SummaryDialogue(SIGNED, report=Report()).certificate_words
        assert verified == f"✓ verified: APA-02 accepted\nCertificate: {PATH}"

    def test_its_steps_are_done_failed_or_still_to_come(self):
        def steps(facts: SummaryFacts, report: Report | None = None) -> list[bool | None]:
            return [done for _, done in SummaryDialogue(facts, report=report).certificate_steps]

        assert [words for words, _ in SummaryDialogue(ACCEPTED).certificate_steps] == ["sign", "store", "verify", "QA"]
        assert steps(ACCEPTED) == [None, None, None, None]
        assert steps(SIGNED) == [True, True, None, None]  # of an earlier run: not verified here
        assert steps(SIGNED, Report()) == [True, True, True, None]
        assert steps(SIGNED, Report("not valid")) == [True, True, False, None]
        assert steps(replace(SIGNED, signatures=(ANN, replace(ANN, role=QA))), Report()) == [True] * 4

    def test_its_page_is_opened_once_there_is_one(self):
        assert press(SIGNED, "ctrl+e").effects == (Do.OPEN_PAGE,)
        assert press(ACCEPTED, "ctrl+e").words.text == "No certificate yet. ^S: sign"

    def test_a_void_one_is_not_to_be_handed_out(self):
        words = SummaryDialogue(replace(ACCEPTED, void=PATH)).certificate_words
        assert "✗ APA-02.pdf is void: it is older than the last change\n→ Do not hand it out. ^S: sign again" in words
        held = SummaryDialogue(replace(ACCEPTED, void=PATH, nonconformances=("stroke: cracked",)))
        assert "and lacks the nonconformance" in held.certificate_words

    @pytest.mark.parametrize(
        ("outcome", "words", "role"),
        [
            ("valid", "Signed and verified. F10: next unit", "good"),
            ("signed", "Signed, not fully verified: APA-02 accepted", "bad"),
            ("not valid", "The certificate does not verify: APA-02 accepted", "bad"),
        ],
    )
    def test_what_its_verification_gave_is_said(self, outcome: str, words: str, role: str):
        turn = dialogue.signed(SummaryDialogue(SIGNED), Report(outcome))
        assert (turn.words.text, turn.words.role, turn.effects) == (words, role, ())

    def test_a_training_tells_what_was_hidden_when_the_technician_has_signed(self):
        training = SummaryDialogue(replace(SIGNED, training=True))
        assert dialogue.signed(training, Report()).effects == (Do.TELL_HIDDEN,)
        assert dialogue.signed(training, Report(countersigned=True)).effects == ()


class TestSigning:
    def test_an_accepted_unit_is_signed_with_a_passphrase_alone(self):
        assert press(ACCEPTED, "ctrl+s").effects == (LookForKeys(TECHNICIAN),)
        ask = asked(ACCEPTED, BenchKeys())
        assert (ask.title, ask.lines, ask.states) == ("Sign APA-02", (AskedLine.PASSPHRASE,), True)
        assert dialogue.answered(SummaryDialogue(ACCEPTED), ask, [SECRET]).effects == (SignAsTechnician(SECRET),)
        assert dialogue.answered(SummaryDialogue(ACCEPTED), ask, None).effects == ()

    @pytest.mark.parametrize(
        ("facts", "keys", "line"),
        [
            (REJECTED, BenchKeys(), AskedLine.WHY),
            (ACCEPTED, BenchKeys(replaces="APA-02/1"), AskedLine.WHY_REPLACED),
            (REJECTED, BenchKeys(replaces="APA-02/1"), AskedLine.WHY_REPLACED),
        ],
    )
    def test_a_unit_that_is_not_accepted_or_replaces_a_certificate_needs_a_reason(
        self, facts: SummaryFacts, keys: BenchKeys, line: AskedLine
    ):
        ask = asked(facts, keys)
        assert ask.lines == (line, AskedLine.PASSPHRASE)
        assert dialogue.answered(SummaryDialogue(facts), ask, [WHY, SECRET]).effects == (SignAsTechnician(SECRET, WHY),)

    def test_the_key_of_the_shift_asks_for_no_passphrase(self):
        ask = asked(REJECTED, BenchKeys(kept=True))
        assert ask.lines == (AskedLine.WHY,)
        assert "The key of Ann is open" in ask.words
        assert dialogue.answered(SummaryDialogue(REJECTED), ask, [WHY]).effects == (SignAsTechnician(reason=WHY),)
        assert asked(ACCEPTED, BenchKeys(kept=True)).lines == ()

    def test_first_keys_are_made_and_where_the_authority_s_passphrase_is_is_read_before_signing(self):
        ask = asked(REJECTED, BenchKeys(exist=False))
        assert ask.lines == (AskedLine.WHY, AskedLine.PASSPHRASE, AskedLine.REPEATED)
        (made,) = dialogue.answered(SummaryDialogue(REJECTED), ask, [WHY, SECRET, SECRET]).effects
        assert made == SignAsTechnician(SECRET, WHY, makes_keys=True)
        told = dialogue.keys_made(SummaryDialogue(REJECTED), made, "/keys/authority.txt")
        assert told.words.text == "Keys were created"
        kept, sign = told.effects
        assert kept == KeepPassphrase(SECRET)  # the page is open for any time: the shift may forget it meanwhile
        assert "/keys/authority.txt" in sign.first
        assert replace(sign, first="") == SignAsTechnician(reason=WHY)
        training = SummaryDialogue(replace(REJECTED, training=True))
        unread = dialogue.keys_made(training, made, "x").effects[-1]
        assert unread == SignAsTechnician(reason=WHY)  # its authority has no owner

    def test_who_cannot_sign_is_told_before_a_passphrase_is_asked_for(self):
        turn = dialogue.keys_found(
            SummaryDialogue(ACCEPTED), LookForKeys(TECHNICIAN), BenchKeys("Ann cannot sign here")
        )
        assert (turn.effects, turn.words.text, turn.words.role) == ((), "Ann cannot sign here", "bad")

    def test_a_signed_result_is_not_signed_again(self):
        turn = press(SIGNED, "ctrl+s")
        assert (turn.effects, turn.words.text) == ((), "Already signed. ^T: countersign")


class TestAhead:
    def test_f2_before_the_result_asks_for_the_passphrase_and_the_question_follows_the_result(self):
        begun = press(replace(OPEN, idle=False), "ctrl+s")
        assert begun.effects == (LookForKeys(TECHNICIAN, ahead=True),)
        assert begun.words.text == "Evaluating; then you confirm what is signed"
        (ask,) = dialogue.keys_found(begun.state, *begun.effects, BenchKeys()).effects
        assert (ask.then, ask.lines, ask.states) == ("ahead", (AskedLine.PASSPHRASE,), False)
        kept = dialogue.answered(begun.state, ask, [SECRET])
        assert kept.effects == (KeepPassphrase(SECRET),)
        judged = dialogue.judged(replace(kept.state, facts=ACCEPTED))
        assert judged.effects == (Do.RING, LookForKeys(TECHNICIAN))
        assert not judged.state.signs

    def test_a_result_behind_an_open_question_waits_for_its_answer(self):
        d = replace(SummaryDialogue(ACCEPTED), signs=True)
        behind = dialogue.judged(replace(d, facts=replace(ACCEPTED, in_front=False)))
        assert behind.effects == (Do.RING,)
        answered = dialogue.answered(replace(behind.state, facts=ACCEPTED), AHEAD, [SECRET])
        assert answered.effects == (KeepPassphrase(SECRET), LookForKeys(TECHNICIAN))

    def test_a_question_that_is_left_signs_nothing_later(self):
        left = dialogue.answered(replace(SummaryDialogue(OPEN), signs=True), AHEAD, None).state
        assert dialogue.judged(replace(left, facts=ACCEPTED)).effects == (Do.RING,)

    def test_what_was_stored_since_is_judged_before_it_is_signed(self):
        assert press(OPEN, "ctrl+s").effects[0] is Do.JUDGE

    @pytest.mark.parametrize("keys", [BenchKeys(exist=False), BenchKeys("another's key"), BenchKeys(kept=True)])
    def test_nothing_is_asked_ahead_that_is_not_needed_or_cannot_be_told_yet(self, keys: BenchKeys):
        turn = dialogue.keys_found(SummaryDialogue(OPEN), LookForKeys(TECHNICIAN, ahead=True), keys)
        assert (turn.effects, turn.words) == ((), None)


AHEAD = Ask("ahead", "Sign APA-02", "", (AskedLine.PASSPHRASE,))


class TestCountersigning:
    def test_the_technician_signs_first_and_quality_assurance_once(self):
        assert press(ACCEPTED, "ctrl+t").words.text == "The technician must sign first: ^S"
        assert press(SIGNED, "ctrl+t").effects == (LookForKeys(QA),)
        both = replace(SIGNED, signatures=(ANN, replace(ANN, role=QA)))
        assert press(both, "ctrl+t").words.text == "Already countersigned"

    def test_an_accepted_unit_needs_the_passphrase_alone(self):
        ask = asked(SIGNED, BenchKeys(), QA)
        assert (ask.lines, ask.states) == ((AskedLine.QA_PASSPHRASE,), False)
        assert dialogue.answered(SummaryDialogue(SIGNED), ask, [SECRET]).effects == (Countersign(SECRET),)

    def test_a_unit_that_is_not_accepted_needs_a_disposition(self):
        ask = asked(replace(SIGNED, verdict="rejected"), BenchKeys(), QA)
        assert ask.lines == (AskedLine.DISPOSITION, AskedLine.REASON, AskedLine.QA_PASSPHRASE)
        assert ask.words == f"The unit is rejected. Decide what is to be done with it:\n{', '.join(CHOICES)}."
        answer = ["scrap", "cracked", SECRET]
        assert dialogue.answered(SummaryDialogue(SIGNED), ask, answer).effects == (
            Countersign(SECRET, "scrap", "cracked"),
        )

    def test_the_other_keys(self):
        assert press(ACCEPTED, "f10").effects == (Do.NEXT_UNIT,)
        assert press(ACCEPTED, "ctrl+l").effects == (Do.LOCK,)
        assert press(ACCEPTED, "ctrl+r").effects == (Do.ASK_REMEDY,)
        assert press(ACCEPTED, "escape").effects == (Do.STOP_OR_LEAVE,)


class SummaryMachine(RuleBasedStateMachine):
    """A technician and quality assurance at one unit whose judgement may be slow, and whose questions may be left."""

    def __init__(self) -> None:
        super().__init__()
        self.facts, self.keys = replace(OPEN, idle=False), BenchKeys()
        self.questions: list[Ask] = []
        self.judging = self.answering = False
        self.signed: list[SignAsTechnician | Countersign] = []
        self.follow(dialogue.opening(OPEN))

    def answer(self, event, *data) -> None:
        now = replace(self.facts, idle=not self.judging, in_front=not self.questions)
        self.follow(event(replace(self.d, facts=now), *data))

    def follow(self, turn: Turn) -> None:
        self.d, self.turn = turn.state, turn
        assert turn.words is None or SECRET not in turn.words.text
        for effect in turn.effects:
            self.execute(effect)

    def execute(self, effect: object) -> None:
        assert SECRET not in repr(effect)
        match effect:
            case Do.JUDGE:
                assert not self.judging, "judged twice at once"
                self.judging = True
            case LookForKeys(role):
                kept = role == TECHNICIAN and self.keys.kept
                self.answer(dialogue.keys_found, effect, replace(self.keys, kept=kept))
            case Ask():
                assert not self.questions, "a question over another one"
                self.questions.append(effect)
            case KeepPassphrase(passphrase):
                assert passphrase == SECRET
                self.keys = replace(self.keys, kept=True)
            case SignAsTechnician(makes_keys=True):
                self.keys = replace(self.keys, exist=True)
                self.answer(dialogue.keys_made, effect, "authority.txt")
            case SignAsTechnician(passphrase, reason):
                assert self.facts.result is not None, "signed before there was a result"
                assert bool(reason) == (self.facts.verdict != "accepted" or bool(self.keys.replaces))
                assert passphrase == SECRET or (self.keys.kept and not passphrase)
                self.signed.append(effect)
                self.facts = replace(self.facts, certificate=PATH, signatures=(ANN,))
                self.keys = replace(self.keys, kept=True)
                self.answer(dialogue.signed, Report())
            case Countersign(choice=choice):
                assert self.facts.certificate is not None
                assert bool(choice) == (self.facts.verdict != "accepted")
                self.signed.append(effect)
                self.facts = replace(self.facts, signatures=(ANN, replace(ANN, role=QA)))
                self.answer(dialogue.signed, Report(countersigned=True))

    @precondition(lambda self: not self.questions)
    @rule(key=st.sampled_from(["ctrl+s", "ctrl+t", "f10", "ctrl+l", "escape"]))
    def press(self, key: str) -> None:
        self.answer(dialogue.press, key)

    @rule(row=st.integers(-1, 3))
    def mark(self, row: int) -> None:
        self.answer(dialogue.marked, row)

    @precondition(lambda self: self.questions)
    @rule(leaves=st.booleans())
    def answer_question(self, leaves: bool) -> None:
        ask = self.questions.pop()
        words = {
            AskedLine.DISPOSITION: "scrap",
            AskedLine.REASON: "cracked",
            AskedLine.WHY: WHY,
            AskedLine.WHY_REPLACED: WHY,
        }
        self.answer(dialogue.answered, ask, None if leaves else [words.get(line, SECRET) for line in ask.lines])

    @precondition(lambda self: self.judging)
    @rule(facts=st.sampled_from([ACCEPTED, REJECTED, None]))
    def judgement_comes(self, facts: SummaryFacts | None) -> None:
        self.judging = False
        if facts is None:
            self.answer(dialogue.not_judged)
        else:
            self.facts = facts
            self.answer(dialogue.judged)

    @rule(exist=st.booleans(), replaces=st.sampled_from(["", "APA-02/1"]), problem=st.sampled_from(["", "another's"]))
    def other_keys(self, exist: bool, replaces: str, problem: str) -> None:
        if not self.questions:
            self.keys = BenchKeys(problem if exist else "", exist, replaces)

    @invariant()
    def nothing_is_kept_and_nothing_is_signed_twice(self) -> None:
        assert SECRET not in repr(self.d)
        assert SECRET not in repr(self.questions)
        assert len([each for each in self.signed if isinstance(each, SignAsTechnician)]) <= 1
        assert len(self.signed) <= 2
        assert self.d.certificate_words
        assert not (self.d.signs and self.facts.result is not None and not self.questions), "F2 was forgotten"


TestSummaryMachine = SummaryMachine.TestCase
TestSummaryMachine.settings = settings(
    max_examples=300 if SOAK else 100, stateful_step_count=40 if SOAK else 25, deadline=None
)
