"""The dialogue on the first screen: operator, unit, its kind and its parts. Shown before the physics is imported."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING

from accept.workflow.dialogue import start_state, units
from accept.workflow.dialogue.begin import Begun, BenchKinds, LookForPassphrase, LookUp
from accept.workflow.dialogue.start_state import (
    CHOOSE_KIND,
    OWN,
    SCAN,
    StartDialogue,
    labels,
    parts_of,
    refuse,
    say,
    without_serial,
)
from accept.workflow.dialogue.turn import Common, FootWords, by_key
from accept.workflow.entry.shift import NOT_TAKEN

if TYPE_CHECKING:
    from accept.workflow.steps.unit_list import KnownUnit, Queue

_PARTS = "Enter: start; the parts may stay empty. ↓: next part"
_NEW = "Enter: begin it. Esc: it is another one"
_NAME = "Type your name; it stands for what you measure and sign"

Do = Enum("Do", "LEAVE")
Turn = start_state.Turn


@dataclass(frozen=True)
class OpenBench:
    """Open the bench; `opened` follows, or `nothing_came`. holds: keys wait for it."""

    operator: str
    holds: bool


@dataclass(frozen=True)
class WaitForBench:
    """Wait until the bench is open and the serial looked up; then answer the key. for_list: until the units are
    there."""

    key: str
    for_list: bool = False


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
    """Proposals of an open bench. operator: who worked here last; serial: the unit to begin with; texts: field -> text
    from the folder of a unit that is continued."""

    operator: str = ""
    serial: str = ""
    texts: Mapping[str, str] = field(default_factory=dict)


def opening(given: Mapping[str, str], problem: str = "", is_open: bool = False) -> Turn:
    """Show the fields. given: field -> what is proposed, and `left`, the unit that was open before; problem: why the
    unit that was wanted is not open; is_open: the bench is already. Otherwise it knows who worked here last: without a
    name, a serial that is scanned meanwhile is not the operator's."""
    left, serial = given.get("left", ""), given.get("serial", "")
    d = StartDialogue({name: given.get(name, "") for name in OWN}, None, problem, left=left)
    d = replace(d, named=d.value("operator"), back=left if serial else "")
    d = replace(d, cursor=d.lacking)
    return Turn(d, () if is_open else (OpenBench(d.value("operator"), holds=not d.value("operator")),))


def opened(d: StartDialogue, bench: BenchKinds, proposed: Proposed) -> Turn:
    """Propose what the bench knows, and ask for parts from here on: to search for the installed products takes longer
    than the first screen may. A proposed serial is replaced by what is typed or scanned."""
    texts = {name: proposed.texts.get(name, d.texts.get(name, "")) for name in labels()}
    texts["operator"] = texts["operator"] or proposed.operator
    texts["serial"] = texts["serial"] or proposed.serial
    if texts["kind"] not in bench.kinds:
        texts["kind"] = bench.kinds[0]
    was_nobody = not d.texts["operator"] and d.cursor == "operator"
    named = d.named or proposed.operator
    d = replace(d, texts=texts, bench=bench, opens=False, lists=True, named=named)
    d = replace(d, cursor=d.lacking if was_nobody else d.cursor)
    select = (Common.SELECT,) if d.cursor == "serial" and texts["serial"] == proposed.serial else ()
    words = _NAME if d.cursor == "operator" else f"Esc: back to {d.back}" if d.back else SCAN
    turn = say(d, d.problem or words, "bad" if d.problem else "quiet", *select, units.Do.LOOK)
    return turn.then(_look)


def nothing_came(d: StartDialogue, why: str) -> Turn:
    """Answer what waited for the bench or for a look; the foot has the reason, which is said again without a bench."""
    return Turn(replace(d, opens=False, looks=False, failure=why))


def no_list(d: StartDialogue, _: str) -> Turn:
    """Answer what waited for the units; the foot has the reason."""
    return Turn(replace(d, lists=False))


def edited(d: StartDialogue, texts: Mapping[str, str], cursor: str | None) -> Turn:
    """Take what was typed meanwhile, and where the cursor is now. Units are shown whose serial holds the letters."""
    text = texts["serial"]
    if text != d.texts["serial"]:
        d = replace(d, typed=text.strip(), row=0, begins=False)
    return _put(replace(d, cursor=cursor), texts)


def _put(d: StartDialogue, texts: Mapping[str, str]) -> Turn:
    """Replace texts. The reason of a refusal goes with the text that was refused; a serial or kind is looked up."""
    changed = {name for name, text in texts.items() if text != d.texts[name]}
    if not changed:
        return Turn(d)
    answered = d.refused in changed
    d = replace(d, texts={**d.texts, **texts}, ends=False, refused=None if answered else d.refused)
    if d.cursor is not None and d.cursor not in d.shown:
        d = replace(d, cursor="kind" if d.begins else "serial")  # it stood in a part that this kind does not have
    following = _look(d) if changed & {"serial", "kind"} and not d.adds else Turn(d)
    return replace(following, words=FootWords(d.scan_words)) if answered else following


def _look(d: StartDialogue) -> Turn:
    """Look up whether the serial is known, if it fits. If it fits one kind only, that kind is proposed."""
    d = replace(d, known=None, looks=False)
    if d.bench is None or not d.value("serial") or d.serial_problem:
        return Turn(d)
    fitting = [d.follows] if d.follows else d.fitting
    if len(fitting) == 1 and d.value("kind") not in fitting:
        return _put(d, {"kind": fitting[0]})
    return Turn(replace(d, looks=True), (LookUp(d.value("serial"), d.value("operator")),))


def looked(d: StartDialogue, asked: LookUp, known: "KnownUnit | None", key_problem: str) -> Turn:
    """Say what is known of a serial. key_problem: why the operator cannot sign here, "" if nothing is known."""
    if asked.serial != d.value("serial") or not d.looks:
        return Turn(d)
    if known is not None and known.kind != d.value("kind"):  # as it was begun, whatever the unit before was
        return _put(d, {"kind": known.kind})
    return Turn(replace(d, looks=False, known=known, key_problem=key_problem))


def _enter(d: StartDialogue) -> Turn:
    """Go to the next field; at the last one, or at a serial that is known, open the unit. Without a serial that is the
    unit under the cursor; while a tray is added, a serial is added to it."""
    if d.cursor not in d.shown:
        return Turn(d)
    if d.cursor == "operator" or (d.cursor == "serial" and not d.value("serial")):
        wait = WaitForBench("enter", for_list=True) if d.waits_for_list else None
    else:
        wait = WaitForBench("enter") if d.waits and (d.is_last or d.cursor == "serial") else None
    if wait is not None:
        return Turn(d, (wait,))
    return _unless_secret(d, d.texts if _opens(d) or d.adds else [d.cursor], "enter")


def _opens(d: StartDialogue) -> bool:
    """Return whether Enter opens a unit, or says why none is opened."""
    return d.is_last or (d.cursor == "serial" and (d.bench is None or d.meant is not None or d.at_once))


def _unless_secret(d: StartDialogue, names: Iterable[str], then: str) -> Turn:
    """Answer a key if no passphrase was typed into one of the fields."""
    typed = [n for n in names if n != "kind" and d.value(n) and not (n == "serial" and d.known is not None)]
    asked = LookForPassphrase(tuple((name, d.texts[name]) for name in typed), then)
    return Turn(d, (asked,)) if typed else _answer(d, then)


def recognized(d: StartDialogue, asked: LookForPassphrase, secret: str | None) -> Turn:
    """Go on with a key after the search for a passphrase: clear the field that holds one, or answer the key, anew if a
    text changed meanwhile. secret: the field with the passphrase, None without one."""
    if secret is not None:
        d = replace(d, typed="") if secret == "serial" else d
        return _put(d, {secret: ""}).then(refuse, secret, NOT_TAKEN)
    now = press(d, asked.then)
    return _answer(d, asked.then) if now.effects == (asked,) else now


def _answer(d: StartDialogue, key: str) -> Turn:
    """Answer a key; no passphrase is among what was typed."""
    if key == "f8":
        known = "" if d.meant is None else f"{d.meant.serial}, {d.meant.words}. Earlier attempts are kept."
        return Turn(d, (AskReason(known),) if known else ())
    if key == "ctrl+z":
        return units.take_off(d)
    if key == "enter" and d.cursor == "operator":
        return _take_name(d)
    if key == "f6" or d.adds:
        return units.tray(d)
    if d.cursor == "serial" and not d.value("serial") and d.here is None:
        return refuse(d, "serial", "Enter the serial number")
    if d.cursor == "serial" and d.serial_problem:
        return refuse(d, "serial", d.serial_problem)
    return _begin(d) if _opens(d) else _go_on(d)


def _take_name(d: StartDialogue) -> Turn:
    """Go from the operator to the serial. What is a serial was scanned too early, and goes to its own line."""
    name, why = d.value("operator"), d.name_problem
    if name and why and not d.value("serial"):
        return _put(d, {"operator": "", "serial": name}).then(refuse, "operator", why)
    if why:
        return refuse(d, "operator", why)
    d = replace(d, cursor="serial", named=name)
    return say(d, SCAN, "quiet", Common.SELECT).then(_look)


def _go_on(d: StartDialogue) -> Turn:
    """Go to the next field: behind a serial to its kind, unless that follows from the serial; then to its parts."""
    d = replace(d, begins=True)
    kind_is_said = d.cursor == "serial" and (d.follows or len(d.fitting) == 1) and parts_of(d.value("kind"))
    at = d.shown.index("kind" if kind_is_said else str(d.cursor))
    following = d.shown[at + 1]
    alone = len(d.fitting) == 1
    return say(replace(d, cursor=following), _PARTS if following != "kind" else _NEW if alone else CHOOSE_KIND)


def _begin(d: StartDialogue, reason: str | None = None) -> Turn:
    """Begin or go on with a unit, or say what is missing. Keys that follow belong to its steps, and wait until it is
    open. reason: of a new attempt; None goes on with the present one if it exists."""
    if d.bench is None:
        why = d.failure or "The bench could not be opened"
        return say(d, f"{why}. Esc, Esc: end the program", "bad")
    operator, unit = d.value("operator"), d.meant
    serial, kind = (d.value("serial"), d.value("kind")) if unit is None else (unit.serial, unit.kind)
    if d.name_problem:
        return refuse(d, "operator", d.name_problem)
    if not serial:
        return refuse(d, "serial", "Enter the serial number")
    if kind not in d.bench.kinds:
        return say(d, f"{serial} is of kind {kind}, for which this bench has no spec", "bad", Common.BELL)
    if problem := d.bench.problem(serial, kind):
        return refuse(d, "serial", f"serial '{serial}': {problem}")
    given = {name: d.value(name) for name in parts_of(kind) if d.value(name)}
    begun = Begun(serial, kind, operator, given, reason, serial in d.confirmed)
    waits = unit is not None and d.queue is not None and d.at is not None and unit in d.queue.units
    return say(d, f"Opening {serial} …", "quiet", Open(begun, d.queue if waits else None))


def confirmed(d: StartDialogue, begun: Begun, answer: str | None) -> Turn:
    """Go on if the serial that was asked about was typed once more."""
    serial = begun.serial
    if answer is None or answer.strip() != serial:
        return say(d, f"{serial} was not confirmed: enter the serial number of the unit on the bench", "bad")
    return _begin(replace(d, confirmed=d.confirmed | {serial}), begun.reason)


def reasoned(d: StartDialogue, reason: str | None) -> Turn:
    """Begin a new attempt. reason: None if the question was left."""
    return Turn(d) if reason is None else _begin(d, reason)


def _new_attempt(d: StartDialogue) -> Turn:
    if d.waits:
        return Turn(d, (WaitForBench("f8"),))
    if d.meant is None or d.adds:
        return say(d, "F8 needs a known unit", "bad")
    return _unless_secret(d, d.texts, "f8")


def _after_list(key: str, answer: Callable[[StartDialogue], Turn]) -> Callable[[StartDialogue], Turn]:
    """Return the answer to a key that needs the units."""
    return lambda d: Turn(d, (WaitForBench(key, for_list=True),)) if d.waits_for_list else answer(d)


def point(d: StartDialogue, row: int, opens: bool) -> Turn:
    """Put the cursor on a unit; open it if it was pointed at twice."""
    turn = units.point(d, row)
    return turn.then(_enter) if opens and not d.adds and turn.state.known is not None else turn


def _turn(d: StartDialogue, way: int) -> Turn:
    """Go to the next queue of units; where a new unit is asked about, to the next field."""
    if d.cursor in ("serial", None) or d.cursor not in d.shown:
        return units.turn(d, way)
    return Turn(replace(d, cursor=d.shown[(d.shown.index(d.cursor) + way) % len(d.shown)]))


def _move(d: StartDialogue, rows: int) -> Turn:
    """Move among the units; where a new unit is asked about, from field to field."""
    if d.cursor in ("serial", None) and not (d.begins and rows == 1):
        return units.move(d, rows)
    at = d.shown.index(d.cursor or "serial") + (rows > 0) - (rows < 0)
    return Turn(replace(d, cursor=d.shown[max(0, min(at, len(d.shown) - 1))]))


def _other_operator(d: StartDialogue) -> Turn:
    """Ask anew who is at the bench."""
    return say(replace(d, cursor="operator"), _NAME, "quiet", Common.SELECT)


def _sign(d: StartDialogue) -> Turn:
    """Open the first unit that waits for a signature; the others follow it."""
    place = next((n for n, queue in enumerate(d.queues) if queue.to_sign), None)
    if place is None:
        return say(d, "No unit waits for a signature", "bad")
    return _enter(units.show_queue(replace(d, adds=False), place).state)


def _leave(d: StartDialogue) -> Turn:
    """Leave what was begun here last: a tray, a new unit, the question who is there; then go back to the unit from
    which a scan led here; then end the program, when asked twice."""
    if d.adds:
        return units.tray(without_serial(d)) if d.added else units.end_tray(d)
    if d.begins or (d.cursor == "operator" and d.value("operator")):
        return say(replace(d, cursor="serial", begins=False), SCAN, "quiet", Common.SELECT)
    if d.back and d.bench is not None:
        d = replace(without_serial(d), back="", texts={**d.texts, "serial": d.back})
        return _look(d).then(lambda d: Turn(d, (WaitForBench("enter"),)))
    words = FootWords("Esc again: end the program", "doubt")
    return Turn(d, (Do.LEAVE,)) if d.ends else Turn(replace(d, ends=True, doubted=""), words=words)


press: Callable[[StartDialogue, str], Turn] = by_key(
    {
        "enter": _enter,
        "tab": _after_list("tab", lambda d: _turn(d, 1)),
        "shift+tab": _after_list("shift+tab", lambda d: _turn(d, -1)),
        "up": lambda d: _move(d, -1),
        "down": lambda d: _move(d, 1),
        "pageup": lambda d: _move(d, -10),
        "pagedown": lambda d: _move(d, 10),
        "f6": _after_list("f6", lambda d: _unless_secret(d, ["operator", "serial"], "f6")),
        "f8": _new_attempt,
        "ctrl+o": _other_operator,
        "ctrl+s": _after_list("ctrl+s", _sign),
        "ctrl+z": _after_list("ctrl+z", lambda d: _unless_secret(d, ["operator"], "ctrl+z")),
        "escape": _leave,
    }
)


def stand_at_lacking(d: StartDialogue) -> Turn:
    """Put the cursor into the first field that lacks something, where a click took it away."""
    return Turn(replace(d, cursor=d.lacking))
