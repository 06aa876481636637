"""The dialogue at the summary of a unit: judged, signed, countersigned. What each key and each event changes, asks for
and says. Passphrases are in effects only, for one turn, and no representation has them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from accept.base.documents.results import unit_word
from accept.store.payloads import CHOICES
from accept.workflow.dialogue.summary_effects import (
    Ask,
    AskedLine,
    BenchKeys,
    Countersign,
    Do,
    KeepPassphrase,
    LookForKeys,
    Report,
    SignAsTechnician,
)
from accept.workflow.dialogue.summary_state import SIGNED, VALID, SummaryDialogue, SummaryFacts, Turn
from accept.workflow.dialogue.turn import FootWords, by_key
from checks.verdict import UnitVerdict

TECHNICIAN, QA = "technician", "qa"
_FIRST_KEYS = (
    "Choose your passphrase: 8 characters or more. The bench's authority and your key as technician are created now. A "
    "forgotten passphrase cannot be recovered."
)
_OFF_THE_BENCH = (
    "The passphrase of the bench's authority is in {}. Move that file and ca.key.pem beside it off the bench: a person "
    "who has both can give keys to anybody. Quality assurance gets a key of its own with: "
    "accept keys request --role qa --name NAME"
)
_FOR_A_SHIFT = "It opens your key for this shift. Forgotten after 15 min without a key, or at once: Ctrl+L."
_OPEN_KEY = "The key of {} is open. Enter: sign. Not you? Esc, then Ctrl+L locks it."


def opening(facts: SummaryFacts) -> Turn:
    """Show the result, which is judged first if its inputs have changed."""
    d = SummaryDialogue(facts)
    return Turn(d, (Do.JUDGE,)) if facts.result is None else _shown(d)


def _say(d: SummaryDialogue, words: str, role: str = "quiet", *effects: object) -> Turn:
    return Turn(d, effects, FootWords(words, role))


def _shown(d: SummaryDialogue) -> Turn:
    qa = "^T: countersign, " if d.accepted and d.awaits_qa else ""
    words = f"Signed. {qa}{d.signed_words}" if d.facts.certificate is not None else "^S: sign this result"
    return _say(replace(d, row=d.worst, failed=False), words).then(_sign_then)


def _sign_then(d: SummaryDialogue) -> Turn:
    """Go on to sign, if its key came before the result and no question is open."""
    if not (d.signs and d.facts.in_front and d.facts.result is not None):
        return Turn(d)
    return _sign(replace(d, signs=False))


def judged(d: SummaryDialogue) -> Turn:
    """Show a new result; it can be heard too."""
    return Turn(d, (Do.RING,)).then(_shown)


def not_judged(d: SummaryDialogue) -> Turn:
    """Show that there is no result; the foot has the reason."""
    return Turn(replace(d, failed=True))


def _judge_again(d: SummaryDialogue) -> Turn:
    return Turn(replace(d, failed=False), (Do.JUDGE,)) if d.failed and d.facts.idle else Turn(d)


def _open_page(d: SummaryDialogue) -> Turn:
    if d.facts.certificate is None:
        return _say(d, "No certificate yet. ^S: sign", "bad")
    return Turn(d, (Do.OPEN_PAGE,))


def marked(d: SummaryDialogue, row: int) -> Turn:
    """Tell about the finding under the cursor."""
    return Turn(replace(d, row=row) if row >= 0 else d)


def _sign(d: SummaryDialogue) -> Turn:
    """Ask what is needed to sign; before the result, for the passphrase."""
    if d.facts.result is None:  # something may have been stored since: what is signed is what is shown
        judge = (Do.JUDGE,) if d.facts.idle else ()
        words = "Evaluating; then you confirm what is signed"
        return _say(replace(d, signs=True), words, "quiet", *judge, LookForKeys(TECHNICIAN, ahead=True))
    if d.facts.certificate is not None:
        return _say(d, "Already signed. ^T: countersign", "bad")
    return Turn(d, (LookForKeys(TECHNICIAN),))


def _countersign(d: SummaryDialogue) -> Turn:
    if d.facts.certificate is None:
        return _say(d, "The technician must sign first: ^S", "bad")
    if len(d.facts.signatures) > 1:
        return _say(d, "Already countersigned", "bad")
    return Turn(d, (LookForKeys(QA),))


def keys_found(d: SummaryDialogue, asked: LookForKeys, keys: BenchKeys) -> Turn:
    """Ask who signs for what is needed with these keys, or say why they do not sign."""
    title = f"Sign {d.facts.serial}"
    if asked.ahead:
        words = f"Nothing is signed yet: once the unit is evaluated you confirm what is signed.\n\n{_FOR_A_SHIFT}"
        asks = keys.exist and not keys.problem and not keys.kept
        return Turn(d, (Ask("ahead", title, words, (AskedLine.PASSPHRASE,)),) if asks else ())
    if keys.problem:
        return _say(d, keys.problem, "bad")
    if asked.role == QA:
        return Turn(d, (_asked_of_qa(d),))
    why = () if d.accepted and not keys.replaces else (AskedLine.WHY_REPLACED if keys.replaces else AskedLine.WHY,)
    if keys.kept:
        return Turn(d, (Ask("sign", title, _OPEN_KEY.format(d.facts.operator), why, states=True, kept=True),))
    if keys.exist:
        return Turn(d, (Ask("sign", title, _FOR_A_SHIFT, (*why, AskedLine.PASSPHRASE), states=True),))
    lines = (*why, AskedLine.PASSPHRASE, AskedLine.REPEATED)
    return Turn(d, (Ask("first keys", title, _FIRST_KEYS, lines, states=True),))


def _asked_of_qa(d: SummaryDialogue) -> Ask:
    """Return the question for the passphrase, and for a unit that was not accepted what is to be done with it."""
    words, lines = "As quality assurance, with the QA key's own passphrase.", [AskedLine.QA_PASSPHRASE]
    if d.facts.verdict != UnitVerdict.ACCEPTED:
        word = unit_word(d.facts.verdict, d.facts.nonconformances)
        words = f"The unit is {word}. Decide what is to be done with it:\n{', '.join(CHOICES)}."
        lines = [AskedLine.DISPOSITION, AskedLine.REASON, AskedLine.QA_PASSPHRASE]
    return Ask("countersign", f"Countersign {d.facts.serial}", words, tuple(lines))


def answered(d: SummaryDialogue, asked: Ask, answer: Sequence[str] | None) -> Turn:
    """Go on from a question. answer: None if it was left."""
    if answer is None:
        return Turn(replace(d, signs=False) if asked.then == "ahead" else d)
    match asked.then, answer:
        case "ahead", [passphrase]:
            return Turn(d, (KeepPassphrase(passphrase),)).then(_sign_then)
        case "sign", [*why] if asked.kept:
            return Turn(d, (SignAsTechnician(reason="".join(why)),))
        case "sign", [*why, passphrase]:
            return Turn(d, (SignAsTechnician(passphrase, "".join(why)),))
        case "first keys", [*why, first, _]:
            return Turn(d, (SignAsTechnician(first, "".join(why), makes_keys=True),))
        case _, [*disposition, passphrase]:
            return Turn(d, (Countersign(passphrase, *disposition),))
    return Turn(d)


def keys_made(d: SummaryDialogue, made: SignAsTechnician, where: str) -> Turn:
    """Sign with new keys, once it was read where the authority's passphrase is; that of a training has no owner. While
    it is read the shift holds the technician's."""
    words = "" if d.facts.training else _OFF_THE_BENCH.format(where)
    sign = SignAsTechnician(reason=made.reason, first=words)
    return _say(d, "Keys were created", "good", KeepPassphrase(made.passphrase), sign)


def signed(d: SummaryDialogue, report: Report) -> Turn:
    """Show a certificate that was signed and verified."""
    d, tells = replace(d, report=report), d.facts.training and not report.countersigned
    hidden = (Do.TELL_HIDDEN,) if tells else ()
    if report.outcome == VALID:
        return _say(d, f"Signed and verified. {d.signed_words}", "good", *hidden)
    if report.outcome == SIGNED:
        return _say(d, f"Signed, not fully verified: {report.reason}", "bad", *hidden)
    return _say(d, f"The certificate does not verify: {report.reason}", "bad", *hidden)


press: Callable[[SummaryDialogue, str], Turn] = by_key(
    {
        "ctrl+s": _sign,
        "ctrl+t": _countersign,
        "ctrl+e": _open_page,
        "f8": _judge_again,
        "f10": lambda d: Turn(d, (Do.NEXT_UNIT,)),
        "ctrl+l": lambda d: Turn(d, (Do.LOCK,)),
        "ctrl+r": lambda d: Turn(d, (Do.ASK_REMEDY,)),
        "escape": lambda d: Turn(d, (Do.STOP_OR_LEAVE,)),
    }
)
