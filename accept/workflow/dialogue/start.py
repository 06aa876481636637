"""The dialogue on the first screen: who is at the bench, which unit, of what kind, made of what. It is on the screen
before the physics is imported."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING

from accept.workflow.dialogue import turn
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookForPassphrase, LookUp
from accept.workflow.dialogue.turn import Common, FootWords, by_key
from accept.workflow.entry.shift import NOT_TAKEN
from specs.plugins import products

if TYPE_CHECKING:
    from accept.workflow.steps.unit_list import KnownUnit, Queue

OWN = ("operator", "serial", "kind")  # fields of every unit; the others are parts
_GO_ON = "Enter: next field; on the last field it starts"
_PARTS = "Enter: start; the parts may stay empty. ↓: next part"

Do = Enum("Do", "LEAVE SHOW_UNITS")  # effects without a parameter; when the units were shown, `chosen` follows


def labels() -> dict[str, str]:
    """Return the fields and their labels: those of every unit, then the parts of the installed products."""
    own = ("Operator", "Serial number (type or scan)", f"Kind ({', '.join(products())})")
    parts = {name: label for product in products().values() for name, label in product.parts.items()}
    return dict(zip(OWN, own, strict=True)) | parts


def parts_of(kind: str) -> tuple[str, ...]:
    """Return the parts of a product, none of one that is not installed."""
    return tuple(products()[kind].parts) if kind in products() else ()


@dataclass(frozen=True)
class OpenBench:
    """Open the bench; `opened` follows, or `nothing_came`. holds: keys wait for it."""

    operator: str
    holds: bool


@dataclass(frozen=True)
class WaitForBench:
    """Wait until the bench is open and the serial looked up; then answer the key."""

    key: str


@dataclass(frozen=True)
class AskReason:
    """Ask why a unit gets a new attempt; `reasoned` follows. words: about the unit."""

    words: str


@dataclass(frozen=True)
class Open:
    """Open a unit. If its serial looks like a known one it is asked for once more; `confirmed` follows. queue: what is
    done at it and then at others, None without."""

    begun: Begun
    queue: "Queue | None" = None


@dataclass(frozen=True)
class Proposed:
    """What an open bench proposes. operator: who worked here last; serial: the unit to begin with; texts: field -> text
    from the folder of a unit that is continued."""

    operator: str = ""
    serial: str = ""
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StartDialogue:
    """texts: field -> what stands there; cursor: the field that is typed into; problem: why the unit that was wanted is
    not open; bench: None until it is open; opens: that is under way; looks: a serial is being looked up; known: its
    unit; about: words beside the fields; refused: the field whose refusal stands at the foot; ends: Escape was pressed
    once; confirmed: serials that were typed once more; queue: serial that was chosen from a list, and its queue."""

    texts: Mapping[str, str] = field(repr=False)
    cursor: str | None
    problem: str = ""
    bench: BenchKinds | None = None
    opens: bool = True
    looks: bool = False
    known: "KnownUnit | None" = None
    about: str = field(default="", repr=False)
    refused: str | None = None
    ends: bool = False
    confirmed: frozenset[str] = frozenset()
    queue: "tuple[str, Queue] | None" = None

    def value(self, name: str) -> str:
        return self.texts[name].strip()

    @property
    def shown(self) -> list[str]:
        """Return the fields of the present kind."""
        return [name for name in self.texts if name in (*OWN, *parts_of(self.value("kind")))]

    @property
    def lacking(self) -> str:
        """Return the first field that lacks something; a serial that is proposed is still to be said."""
        return "serial" if self.value("operator") else "operator"

    @property
    def is_last(self) -> bool:
        """Return whether nothing is to be given behind the cursor: behind an empty part the others stay empty too."""
        return self.cursor == self.shown[-1] or (self.cursor not in (None, *OWN) and not self.value(self.cursor))

    @property
    def waits(self) -> bool:
        """Return whether it is still open what a serial means."""
        return self.opens or self.looks

    @property
    def fitting(self) -> list[str]:
        """Return the kinds for which the serial is valid."""
        bench, serial = self.bench, self.value("serial")
        return [] if bench is None else [kind for kind in bench.kinds if bench.problem(serial, kind) is None]

    @property
    def serial_problem(self) -> str:
        """Return why the serial is valid for no kind, "" if it is for one."""
        if self.bench is None or not self.value("serial") or self.fitting:
            return ""
        kind = self.value("kind") if self.value("kind") in self.bench.kinds else self.bench.kinds[0]
        return f"serial '{self.value('serial')}': {self.bench.problem(self.value('serial'), kind)}"


Turn = turn.Turn[StartDialogue]


def opening(given: Mapping[str, str], problem: str = "", is_open: bool = False) -> Turn:
    """Show the fields. given: field -> what is proposed; problem: why the unit that was wanted is not open; is_open:
    the bench is already. Otherwise it knows who worked here last: without a name, a serial that is scanned meanwhile is
    not the operator's."""
    d = StartDialogue({name: given.get(name, "") for name in labels()}, None, problem)
    d = replace(d, cursor=d.lacking)
    return Turn(d, () if is_open else (OpenBench(d.value("operator"), holds=not d.value("operator")),))


def _say(d: StartDialogue, words: str, role: str = "quiet", *effects: object) -> Turn:
    return Turn(replace(d, ends=False), effects, FootWords(words, role))  # the question of Escape is not seen any more


def opened(d: StartDialogue, bench: BenchKinds, proposed: Proposed) -> Turn:
    """Propose what the bench knows; a proposed serial is replaced by what is typed or scanned."""
    texts = {**d.texts, **{name: text for name, text in proposed.texts.items() if name in d.texts}}
    texts["operator"] = texts["operator"] or proposed.operator
    texts["serial"] = texts["serial"] or proposed.serial
    if texts["kind"] not in bench.kinds:
        texts["kind"] = bench.kinds[0]
    was_nobody = not d.texts["operator"] and d.cursor == "operator"
    d = replace(d, texts=texts, bench=bench, opens=False)
    d = replace(d, cursor=d.lacking if was_nobody else d.cursor)
    select = (Common.SELECT,) if d.cursor == "serial" and texts["serial"] == proposed.serial else ()
    return _say(d, d.problem or _GO_ON, "bad" if d.problem else "quiet", *select).then(_look)


def nothing_came(d: StartDialogue, _: str) -> Turn:
    """Answer what waited for the bench or for a look; the foot has the reason."""
    return Turn(replace(d, opens=False, looks=False))


def edited(d: StartDialogue, texts: Mapping[str, str], cursor: str | None) -> Turn:
    """Take what was typed meanwhile, and where the cursor is now."""
    return _put(replace(d, cursor=cursor), texts)


def _put(d: StartDialogue, texts: Mapping[str, str]) -> Turn:
    """Replace texts. Why a field was refused goes with what stood there; a serial or kind is looked up."""
    changed = {name for name, text in texts.items() if text != d.texts[name]}
    if not changed:
        return Turn(d)
    answered = d.refused in changed
    d = replace(d, texts={**d.texts, **texts}, ends=False, refused=None if answered else d.refused)
    if d.cursor is not None and d.cursor not in d.shown:
        d = replace(d, cursor="kind")  # it stood in a part that this kind does not have
    following = _look(d) if changed & {"serial", "kind"} else Turn(d)
    return replace(following, words=FootWords(_GO_ON)) if answered else following


def _look(d: StartDialogue) -> Turn:
    """Say beside the fields whether the serial fits, and look up whether it is known. If it fits one kind only, that
    kind is proposed."""
    d = replace(d, known=None, about="", looks=False)
    if d.bench is None or not d.value("serial"):
        return Turn(d)
    if d.serial_problem:
        return Turn(replace(d, about=f"✗ {d.serial_problem}"))
    if len(d.fitting) == 1 and d.value("kind") not in d.fitting:
        return _put(d, {"kind": d.fitting[0]})
    return Turn(replace(d, looks=True), (LookUp(d.value("serial"), d.value("operator")),))


def looked(d: StartDialogue, asked: LookUp, known: "KnownUnit | None", key_problem: str) -> Turn:
    """Say what is known of a serial. key_problem: why the operator cannot sign here, "" if nothing is known."""
    if asked.serial != d.value("serial"):
        return Turn(d)
    if known is not None and known.kind != d.value("kind"):  # as it was begun, whatever the unit before was
        return _put(d, {"kind": known.kind})
    words = ""
    if known is not None:
        words = f"{known.serial} is known: {known.words}. Enter: continue; F8: new attempt.\n{known.handed_over}"
    elif d.bench is not None and d.value("kind") in d.bench.kinds:  # Enter says what is wrong with another kind
        words = f"new unit {asked.serial}"
    return Turn(replace(d, looks=False, known=known, about="\n".join(filter(None, (words, key_problem)))))


def _enter(d: StartDialogue) -> Turn:
    """Go to the next field; at the last one, or at a serial that is known, open the unit."""
    if d.cursor not in d.shown:
        return Turn(d)
    if d.waits and (d.is_last or d.cursor == "serial"):
        return Turn(d, (WaitForBench("enter"),))
    return _unless_secret(d, d.shown if _begins(d) else [d.cursor], "enter")


def _begins(d: StartDialogue) -> bool:
    return d.is_last or (d.cursor == "serial" and d.known is not None)


def _unless_secret(d: StartDialogue, names: Iterable[str], then: str) -> Turn:
    """Answer a key if no passphrase was typed into one of the fields."""
    typed = [name for name in names if d.value(name) and not (name == "serial" and d.known is not None)]
    asked = LookForPassphrase(tuple((name, d.texts[name]) for name in typed), then)
    return Turn(d, (asked,)) if typed else _answer(d, then)


def recognized(d: StartDialogue, asked: LookForPassphrase, secret: str | None) -> Turn:
    """Answer the key, anew if something else was typed meanwhile, or take a passphrase away. secret: the field that it
    was typed into, None without one."""
    if secret is not None:
        return _put(d, {secret: ""}).then(_refuse, secret, NOT_TAKEN)
    now = press(d, asked.then)
    return _answer(d, asked.then) if now.effects == (asked,) else now


def _answer(d: StartDialogue, key: str) -> Turn:
    """Answer a key; no passphrase is among what was typed."""
    if key == "f2":
        return Turn(d, (Do.SHOW_UNITS,) if d.bench is not None else ())
    if key == "f8":
        known = "" if d.known is None else f"{d.known.serial}, {d.known.words}. Earlier attempts are kept."
        return Turn(d, (AskReason(known),) if known else ())
    if d.cursor == "operator" and not d.value("operator"):
        return _refuse(d, "operator", "Enter your name")
    if d.cursor == "serial" and d.serial_problem:
        return _refuse(d, "serial", d.serial_problem)
    if d.cursor is None or _begins(d):
        return Turn(d) if d.cursor is None else _begin(d)
    following = d.shown[d.shown.index(d.cursor) + 1]
    return _say(replace(d, cursor=following), _GO_ON if following in OWN else _PARTS)


def _refuse(d: StartDialogue, name: str, why: str) -> Turn:
    """Stay in a field, or go to it, and say why; what is typed or scanned next replaces what stands there."""
    return _say(replace(d, cursor=name, refused=name), why, "bad", Common.SELECT, Common.BELL)


def _begin(d: StartDialogue, reason: str | None = None) -> Turn:
    """Begin or go on with a unit, or say what is missing. Keys that follow belong to its steps, and wait until it is
    open. reason: of a new attempt; None goes on with the present one if it exists."""
    if d.bench is None:
        return _say(d, "The bench could not be opened. Esc, Esc: end the program", "bad")
    operator, serial, kind = d.value("operator"), d.value("serial"), d.value("kind")
    kinds = f"the kind: {' or '.join(d.bench.kinds)}{f', not {kind!r}' if kind else ''}"
    wanted = {
        "operator": "" if operator else "your name",
        "serial": "" if serial else "the serial number",
        "kind": "" if kind in d.bench.kinds else kinds,
    }
    if missing := [name for name, words in wanted.items() if words]:
        return _refuse(d, missing[0], f"Enter {' and '.join(wanted[name] for name in missing)}")
    if problem := d.bench.problem(serial, kind):
        return _refuse(d, "serial", f"serial '{serial}': {problem}")
    given = {name: d.value(name) for name in parts_of(kind) if d.value(name)}
    begun = Begun(serial, kind, operator, given, reason, serial in d.confirmed)
    queue = d.queue[1] if d.queue is not None and d.queue[0] == serial else None
    return _say(d, f"Opening {serial} …", "quiet", Open(begun, queue))


def confirmed(d: StartDialogue, begun: Begun, answer: str | None) -> Turn:
    """Go on if the serial that was asked about was typed once more."""
    serial = begun.serial
    if answer is None or answer.strip() != serial:
        return _say(d, f"{serial} was not confirmed: enter the serial number of the unit on the bench", "bad")
    return _begin(replace(d, confirmed=d.confirmed | {serial}), begun.reason)


def reasoned(d: StartDialogue, reason: str | None) -> Turn:
    """Begin a new attempt. reason: None if the question was left."""
    return Turn(d) if reason is None else _begin(d, reason)


def chosen(d: StartDialogue, unit: "KnownUnit", queue: "Queue | None") -> Turn:
    """Open the unit that was chosen from a list."""
    d = replace(d, queue=None if queue is None else (unit.serial, queue))
    return _put(d, {"serial": unit.serial, "kind": unit.kind}).then(_begin)


def _new_attempt(d: StartDialogue) -> Turn:
    if d.waits:
        return Turn(d, (WaitForBench("f8"),))
    return _unless_secret(d, d.texts, "f8") if d.known is not None else _say(d, "F8 needs a known unit", "bad")


def _list(d: StartDialogue) -> Turn:
    """Show the units that were begun here and what they wait for; units are added there in the operator's name."""
    return Turn(d, (WaitForBench("f2"),)) if d.waits else _unless_secret(d, ["operator"], "f2")


def _leave(d: StartDialogue) -> Turn:
    words = FootWords("Esc again: end the program", "doubt")
    return Turn(d, (Do.LEAVE,)) if d.ends else Turn(replace(d, ends=True), words=words)


press: Callable[[StartDialogue, str], Turn] = by_key(
    {
        "enter": _enter,
        "f2": _list,
        "f8": _new_attempt,
        "escape": _leave,
    }
)


def stand_at_lacking(d: StartDialogue) -> Turn:
    """Put the cursor into the first field that lacks something, where a click took it away."""
    return Turn(replace(d, cursor=d.lacking))
