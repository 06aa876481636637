"""The dialogue at one step: what each key and each event changes, asks for and says."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import PurePath

from accept.store.payloads import StepJudged
from accept.workflow.dialogue import step_effects as do
from accept.workflow.dialogue.step_effects import Do, Place, StoreEntry
from accept.workflow.dialogue.step_state import StepDialogue, StepFacts, Turn
from accept.workflow.dialogue.turn import Common, FootWords, Toast, by_key
from accept.workflow.entry import parse_entry
from accept.workflow.entry.parse_entry import EntryError
from accept.workflow.entry.record_folder import Proposals
from accept.workflow.entry.shift import NOT_TAKEN
from accept.workflow.steps.plan import WorkflowStep, has_files, is_needed
from accept.workflow.worker.not_done import STOPPED
from checks.declare import CsvTable, Form, Measured, Scalar, Series, Vector

_RUNNING = "Running. Esc: stop"
_MEASURING = "Measuring. Esc stops it, and nothing of it is kept"
_NO_ENTRIES = "Nothing to repeat: this step has no entries"


def opening(step: WorkflowStep, facts: StepFacts) -> Turn:
    """Open the step. Without any entry its form is the one for which there are records."""
    d = StepDialogue(step, facts, step.form(facts.state.form))
    if not step.derived:
        return Turn(d, (_first_look(d, "opened"),))
    if d.complete and facts.judgement is None:
        return _judge(d)
    return _say(d, f"{d.enter_words}, F3: compare again") if d.complete else _say(d, d.lacking, "bad")


def _first_look(d: StepDialogue, then: str) -> do.LookForRecords:
    forms = (d.form,) if d.facts.state.entries or d.is_read else (d.form, *d.step.check.forms)
    return do.LookForRecords(forms, then)


def _say(d: StepDialogue, words: str, role: str = "quiet", *effects: object) -> Turn:
    return Turn(replace(d, hints=False), effects, FootWords(words, role))


def _hint(d: StepDialogue) -> Turn:
    return Turn(replace(d, hints=True), words=d.hint)


def _enter(d: StepDialogue) -> Turn:
    """Save the entry and go on at once: the next key belongs to the next line."""
    if d.step.derived:
        return _say(d, _RUNNING) if d.stoppable else _go_further(d)
    n = d.cursor if d.cursor is not None else d.refused
    if n is None:
        return Turn(d, (do.Settle("finish"),))
    if d.lines[n].text.strip():
        return Turn(d, (_recognize(d, n, repeat=False),))
    if (file := d.file(n)) is not None:
        return _give(d, n, file.name)
    if d.dispensable:
        return Turn(d, (do.Settle("finish"),))
    line = d.lines[n]
    if is_needed(line.place.declared) and not (line.pending or d.has(n)):  # what comes next would be that of another
        return _say(d, f"{line.place.name} is required. {d.what_now}. ↓: next field", "bad")
    return _go_on(d, n).then(_hint)


def _recognize(d: StepDialogue, n: int, repeat: bool) -> do.Recognize:
    line = d.lines[n]
    text = line.text.strip()
    may_be_serial = not repeat and any(map(str.isalpha, text)) and not any(map(str.isspace, text))
    if may_be_serial and not line.place.is_file:
        with suppress(EntryError):
            parse_entry.parse_number(text, line.place.unit)
            may_be_serial = False
    return do.Recognize(line.place.key, line.text, line.place.is_file, may_be_serial, repeat)


def recognized(d: StepDialogue, asked: do.Recognize, kind: str) -> Turn:
    """Take a text. kind: `unit` for the serial of one, `passphrase`, "" for everything else."""
    n = d.at(asked.place)
    if n is None:
        return Turn(d)
    if not kind:
        return _give(d, n, asked.text, asked.repeat)
    d = d.with_line(n, text="", doubted=None)
    if kind == "unit":
        return Turn(d, (do.GoToUnit(asked.text.strip(), d.queue or d.own_queue),))
    return _say(d, NOT_TAKEN, "bad", Common.BELL)


def edited(d: StepDialogue, texts: tuple[str, ...], cursor: int | None) -> Turn:
    """Take what was typed meanwhile. A question at the foot goes with the value that it is about."""
    asked = None if d.asked is None else d.lines[d.asked].doubted
    d = d.typed(texts, cursor)
    return Turn(d) if asked is None or d.in_question else _hint(replace(d, asked=None))


def take_value(d: StepDialogue, text: str) -> Turn:
    """Give a value that was typed elsewhere to the line with the cursor, if it takes one."""
    if d.here is None or d.cursor is None:
        return _say(d, f"{text} was not saved: this step is complete. ↑ ↓: choose the field to correct", "bad")
    if d.here.place.is_file:
        return _say(d, f"{text} was not saved: {d.here.place.name} is a file. {d.what_now}", "bad")
    return _give(d, d.cursor, text)


def _give(d: StepDialogue, n: int, text: str, repeat: bool = False, sure: bool = False) -> Turn:
    """Send an entry to the store, or say why not. sure: it was in question already. The cursor goes on at once, because
    what was typed ahead belongs to the next line, and comes back to a refused entry if nothing was."""
    place = d.lines[n].place
    try:
        match place.declared:
            case Series() | CsvTable() as declared:
                given = _save(d, n, StoreEntry(place.key, declared, text))
            case Vector() as declared if parse_entry.are_several(text, declared.size):
                given = _take_all(d, n, parse_entry.parse_list(text, declared), text, sure)
            case Scalar() as declared:
                given = _take(d, n, parse_entry.parse_scalar(text, declared), repeat, text, sure)
            case _:
                given = _take(d, n, parse_entry.parse_number(text, place.unit), repeat, text, sure)
    except EntryError as e:
        d = d.with_line(n, text=d.lines[n].text or text, refusal=f"✗ {e}", doubted=None)
        is_serial = not place.is_file and text[:1].isalpha() and text[-1:].isdigit()
        unit = ". A new unit? Esc, then scan it" if is_serial else ""
        given = _say(d, f"{place.name}: not saved. Type it again{unit}", "bad", Common.BELL, do.ReturnLater(place.key))
    return given.then(_go_on, n)


def _save(d: StepDialogue, n: int, entry: StoreEntry) -> Turn:
    """Send an entry: its line is free."""
    return Turn(d.with_line(n, text="", doubted=None, refusal="", pending=d.lines[n].pending + 1), (entry,))


def _take(d: StepDialogue, n: int, measured: Measured, repeat: bool, text: str, sure: bool) -> Turn:
    place = d.lines[n].place
    if not sure and (question := _doubt(d, n, measured.value)):
        return _ask(d.with_line(n, repeats=repeat), n, text, question, Common.BELL, do.ReturnLater(place.key))
    return _save(d, n, StoreEntry(place.key, place.declared, text, measured, repeat))


def _doubt(d: StepDialogue, n: int, value: float) -> str:
    place, limits = d.lines[n].place, d.step.asked.limits
    if not isinstance(place.declared, Scalar | Vector):
        return ""
    usual, passing = parse_entry.usual_range(place.declared, limits), parse_entry.passing_range(place.declared, limits)
    return parse_entry.doubt(value, place.unit, usual, passing)


def _take_all(d: StepDialogue, n: int, values: Sequence[float], text: str, sure: bool) -> Turn:
    """Take all values of a vector, or ask about them together."""
    mine = [k for k, line in enumerate(d.lines) if line.place.declared == d.lines[n].place.declared]
    unusual = next((q for k, value in zip(mine, values, strict=True) if (q := _doubt(d, k, value))), "")
    if unusual and not sure:
        asked = _ask(d, mine[0], text, unusual, do.ReturnLater(d.lines[mine[0]].place.key))
        return replace(asked, words=FootWords(f"{unusual}. ^K or F9: keep all", "doubt"))
    taken = Turn(d)
    for k, value in zip(mine, values, strict=True):
        taken = taken.then(_take, k, Measured(value), False, f"{value:.9g} {d.lines[k].place.unit}", True)
    return taken


def _ask(d: StepDialogue, n: int, text: str, question: str, *effects: object) -> Turn:
    """Ask about an entry, below its line and at the foot."""
    line = d.lines[n]
    d = replace(d.with_line(n, text=line.text or text, doubted=text, question=question, refusal=""), asked=n)
    return _say(d, f"{line.place.name}: {question}. ^K or F9: keep it, or type another", "doubt", *effects)


def _keep_or_sum_up(d: StepDialogue) -> Turn:
    """Go to the summary; while a value is asked about, accept it."""
    if d.doubted:
        return _keep(d)
    typed = next((k for k, line in enumerate(d.lines) if line.text.strip()), None)
    if typed is None:
        return Turn(d, (do.Settle("summary"),))
    what = "is saved, what was typed over it is not" if d.has(typed) else "is not saved"
    return _say(d, f"{d.lines[typed].place.name} {what}. Enter: save it", "bad")


def _keep(d: StepDialogue) -> Turn:
    """Accept the value in question as typed. Each of several values is shown before it is accepted."""
    n = next((n for n in (d.cursor, d.asked, *d.doubted) if n in d.doubted), None)
    if n is None:
        return _say(d, "No value is asked about")
    line = d.lines[n]
    if n != d.asked:
        asked = _ask(d, n, line.doubted or "", line.question)
        return replace(asked, state=replace(asked.state, cursor=n))
    if line.text != line.doubted:  # it was typed again meanwhile: that is another entry
        return _say(d, "The entry was changed. Enter: save it", "bad")
    return _give(replace(d, asked=None), n, line.doubted, line.repeats, sure=True)


def _go_on(d: StepDialogue, after: int | None) -> Turn:
    """Move the cursor to the next line without a saved or pending value, behind `after` if given, then to one that is
    needed or for which a record is proposed. It moves at once, so that no key comes between, and leaves the lines if
    every value is there, so that none is overwritten unseen."""
    empty = [n for n, line in enumerate(d.lines) if not (line.pending or d.has(n))]
    behind = empty if after is None else [n for n in empty if n > after]
    wanted = [n for n in empty if is_needed(d.lines[n].place.declared) or d.proposed(n) is not None]
    cursor = next(iter(behind or wanted), None)
    stays = cursor is not None and cursor == after
    return Turn(replace(d, cursor=cursor, again=None, given=after), (Common.SELECT,) if stays else ())


def _move(d: StepDialogue, way: int) -> Turn:
    if not d.lines:
        return Turn(d)
    between = (d.given if d.given is not None else -1) + (way < 0)  # the line that was given last and the next
    now = d.cursor if d.cursor is not None else between
    d = replace(d, again=None, cursor=(now + way) % len(d.lines))
    return Turn(d) if d.in_question else _hint(d)


def returned(d: StepDialogue, place: Place) -> Turn:
    """Put the cursor back to an entry that was refused or is in question, unless it was saved or something was typed
    elsewhere meanwhile: what is typed next is its correction, and no value of the next line."""
    n = d.at(place)
    if n is None or (d.here is not None and d.here.text) or d.reason(n)[1] not in ("refused", "doubted"):
        return Turn(d)
    return Turn(replace(d, cursor=n), (Common.SELECT,))


def moved(d: StepDialogue) -> Turn:
    """Say what the line wants in which the cursor is now, if that of the other was shown."""
    return _hint(d) if d.hints else Turn(d)


def _pick(d: StepDialogue) -> Turn:
    """List the files for the present line, or for the only one that can be meant."""
    n = d.cursor
    if n is None or not d.lines[n].place.is_file:
        files = [k for k, line in enumerate(d.lines) if line.place.is_file]
        empty = [k for k in files if not d.has(k)]
        n = next(iter(empty or (files if len(files) == 1 else [])), None)  # the only one may be replaced
    declared = None if n is None else d.lines[n].place.declared
    if n is None or not isinstance(declared, CsvTable | Series):
        others = any(map(has_files, d.step.check.forms))
        full = "No empty field for a file. ↑ ↓: choose the field to replace"
        other = "This field wants a number. ^F: take a file" if others else "This step takes no file"
        return _say(d, full if has_files(d.form) else other, "bad")
    proposed = d.proposed(n)
    return Turn(d, (do.PickFile(d.lines[n].place.key, declared, proposed.name if proposed is not None else ""),))


def picked(d: StepDialogue, place: Place, text: str) -> Turn:
    """Take a file from the list."""
    n = d.at(place)
    return Turn(d) if n is None else _give(d, n, text)


def _read_or_compare(d: StepDialogue) -> Turn:
    """Read the instrument, or compare a derived step; a saved value is replaced only when asked twice."""
    n = d.cursor
    if d.step.derived and not d.stoppable:
        return _judge(d) if d.complete else _say(d, d.lacking, "bad")
    if d.step.derived:
        return _say(d, _RUNNING)
    if d.reads or d.measures:
        return _too_early(d)
    if n is None:
        return _say(d, "Step complete. ↑ ↓: choose a field to read again")
    if d.has(n) and d.again != n:
        words = f"{d.lines[n].place.name} is saved. F3 again: replace it. F4: one more reading of it"
        return _say(replace(d, again=n), words, "doubt")
    return _read(d, n, repeat=False)


def _repeat(d: StepDialogue) -> Turn:
    """Take one more reading of the same value, typed or from the instrument."""
    if d.here is not None and d.cursor is not None and d.here.text.strip():
        return Turn(d, (_recognize(d, d.cursor, repeat=True),))
    if d.reads or d.measures:
        return _too_early(d)
    if d.cursor is not None:
        return _read(d, d.cursor, repeat=True)
    return _say(d, "Step complete: nothing was read. ↑ ↓: choose the field, F4: one more reading of it", "doubt")


def _too_early(d: StepDialogue) -> Turn:
    """Say that nothing is read for this key: the probe would still be at the point before."""
    words = "Wait: a reading is under way. Press F3 again when it is saved"
    return _say(replace(d, early=True), words, "bad", Common.BELL)


def _read(d: StepDialogue, n: int, repeat: bool) -> Turn:
    place = d.lines[n].place
    if place.is_file and d.facts.records:  # where a record is proposed, only when asked twice: it takes minutes
        proposed = next((file.name for k in range(len(d.lines)) if (file := d.proposed(k)) is not None), "")
        if not proposed or d.again == n:
            return Turn(replace(d, measures=True), (Do.MEASURE,))
        words = f"Enter: take {proposed}. F3 again: measure at the rig, some minutes; Esc stops it"
        return _say(replace(d, again=n), words, "doubt")
    if place.is_file or place.key not in d.facts.offers:
        return _say(d, f"No instrument for this field; {d.what_now if place.is_file else 'type the value'}", "bad")
    return _save(replace(d, reads=True), n, StoreEntry(place.key, place.declared, repeat=repeat)).then(_go_on, n)


def measured(d: StepDialogue, notes: Sequence[str] | None) -> Turn:
    """Go on from a step that was measured as a whole. notes: None if that failed."""
    d = replace(d, measures=False)
    if notes is None:
        return _go_on(d, None)
    return _done(d, Toast("Saved", "\n".join([*notes, "^Z takes back the last entry"])))


def _done(d: StepDialogue, done: Toast) -> Turn:
    """Tell what was done, where no judgement takes its place, and go on."""
    gone = Turn(d, (done,)).then(_go_on, None)
    gone = gone.then(_judge) if d.complete else gone
    return gone.then(lambda d: _say(d, d.what_now))


def stored(d: StepDialogue, entry: StoreEntry, done: Toast, origin: str = "") -> Turn:
    """Show an entry that is in the store; judge the step as soon as nothing is missing. done: what was saved, and when;
    origin: path of a record."""
    d = _ended(d, entry)
    taken = PurePath(origin).name
    if entry.is_file:  # it is proposed no more, and the record it replaces may be proposed again
        d = replace(d, proposals={name: one for name, one in d.proposals.items() if one.name != taken})
    early = "The second F3 came too early: nothing was read. " if d.early else ""
    again = looks(d) if entry.is_file else ()
    role = "doubt" if d.early else "quiet"
    said = _say(replace(d, early=False), f"{early}{d.what_now}", role, done, *again)
    return said.then(_judge) if d.complete and not (d.awaits_records and d.cursor is not None) else said


def _ended(d: StepDialogue, entry: StoreEntry) -> StepDialogue:
    """Return the state after an entry has reached the store, or was refused by it."""
    n = d.at(entry.place)
    d = replace(d, reads=d.reads and not entry.is_reading)
    return d if n is None else d.with_line(n, pending=max(0, d.lines[n].pending - 1))


def not_stored(d: StepDialogue, entry: StoreEntry, why: str, is_there: bool = False) -> Turn:
    """Put back an entry that is not in the store, and the cursor, unless something else was typed already. is_there: it
    names a file, which is of no use: Enter takes another."""
    d = _ended(replace(d, early=False), entry)
    refused = {PurePath(path).name for path in d.facts.state.unusable}
    d = replace(d, proposals={name: one for name, one in d.proposals.items() if one.name not in refused})
    if (n := d.at(entry.place)) is not None:
        d = d.with_line(n, text=d.lines[n].text or ("" if is_there else entry.text), refusal=f"✗ {why}", doubted=None)
    advice = why.rpartition("→ ")[2]
    repair = ". ^R: repair (training)" if d.facts.training else ""
    if entry.is_reading:  # its field has the fault
        why = "Not read, nothing is saved. F3: again, or type the value"
    words = f"{PurePath(entry.text).name}: not taken. {advice[:1].upper()}{advice[1:]}{repair}" if is_there else why
    return _say(d, words, "bad", *([Common.SELECT] if n == d.cursor else []), *looks(d), do.ReturnLater(entry.place))


def looks(d: StepDialogue) -> tuple[do.LookForRecords, ...]:
    """Return the look for records that is due each second: for the present form, or, before anything was given, for the
    others, to which the step changes then."""
    if d.step.derived or not d.lines:
        return ()
    if has_files(d.form):
        return (do.LookForRecords((d.form,), "again"),)
    others = tuple(form for form in d.step.check.forms if has_files(form))
    return () if d.begun or d.chosen or d.is_read else (do.LookForRecords(others, "turn"),)


def looked(d: StepDialogue, look: do.LookForRecords, found: Sequence[tuple[Form, Proposals]], now: float) -> Turn:
    """Propose the records that were found for each form. now: seconds since 1970."""
    first = next(((form, proposals) for form, proposals in found if proposals), None)
    match look.then:
        case "again":
            return _found(d, *found[0], now) if found else Turn(d)
        case "turn" if first is None or d.begun or d.chosen:
            return Turn(d)
        case "opened" | "mended" if first is None:
            first = d.form, {}
        case "chosen":
            first = look.forms[0], found[0][1] if found else {}
    gone = _go_on(d.laid_out(*(first or (d.form, {})), now), None)
    if look.then == "mended":
        return gone.then(lambda d: _say(d, f"New records are there. {d.what_now}", "saved"))
    hinted = gone.then(_hint)
    return hinted.then(_judge) if look.then == "opened" and d.complete else hinted


def _found(d: StepDialogue, form: Form, found: Proposals, now: float) -> Turn:
    """Propose other records than before; the cursor goes to a new one unless its own line is begun."""
    if form is not d.form:
        return Turn(d)
    if found == d.proposals:
        return Turn(replace(d, looked=now))  # their age is shown
    before = [d.proposed(n) for n in range(len(d.lines))]
    d = replace(d, proposals=found, looked=now)
    new = [n for n, file in enumerate(before) if d.proposed(n) is not None and d.proposed(n) != file]
    if new and (d.here is None or d.cursor is None or not (d.here.text or d.proposed(d.cursor))):
        d = replace(d, cursor=new[0])
    file = None if d.cursor is None else d.proposed(d.cursor)
    if d.here is not None and d.cursor in new and file is not None:  # the foot names what Enter takes
        return _say(d, f"{d.described(file)}: {d.here.place.name}? Enter: take it")
    return _hint(d) if d.hints or (d.cursor is not None and before[d.cursor] != file) else Turn(d)


def _judge(d: StepDialogue) -> Turn:
    return Turn(replace(d, judges=True, stopped=False), (Do.JUDGE,))


def judged(d: StepDialogue, _: StepJudged | None = None) -> Turn:
    """Show the judgement; a question or refusal stays at the foot."""
    d = replace(d, judges=False)
    if d.step.check.model is not None:
        return _say(d, d.complete_words, "bad") if d.is_bad else _say(d, f"Compared. {d.enter_words}", "good")
    at_foot = any(d.reason(n)[1] in ("doubted", "refused") for n in range(len(d.lines)))
    return _say(d, d.what_now, "bad") if d.is_bad and not at_foot else Turn(d)


def not_judged(d: StepDialogue, why: str) -> Turn:
    """Say why there is no judgement."""
    d = replace(d, judges=False, stopped=True)
    return _say(d, "Stopped. F3: compare again", "doubt") if why == STOPPED else _say(d, why, "bad")


def settled(d: StepDialogue, then: str) -> Turn:
    """Do what waited until all was saved."""
    match then:
        case "finish" if (n := d.refused) is not None:
            return Turn(replace(d, cursor=n))
        case "finish" if d.complete and d.facts.judgement is None and not d.judges:
            return _judge(d)
        case "finish":
            return _go_further(d)
        case "summary":
            return Turn(d, (Do.STOP if d.stoppable else do.Leave(None),))
    bell = (Common.BELL,) if d.is_bad else ()
    if then == "next unit" and d.queue is not None:
        return Turn(d, (*bell, do.NextUnit(d.queue, d.left_words, ends=True)))
    return Turn(d, (*bell, do.NextUnit(d.own_queue, d.left_words, goes_on=d.queue)))


def _go_further(d: StepDialogue) -> Turn:
    """Go on to the next step; of a queue, to the next unit as soon as this one has nothing more to do in it."""
    stays = d.queue is None or d.next_at_rig is not None
    return Turn(d, (do.Leave(True) if stays else do.Settle("next unit", judged=True),))


def no_next_unit(d: StepDialogue, asked: do.NextUnit, why: str) -> Turn:
    """Say why no other unit was opened."""
    if not asked.ends:
        return _say(d, why, "bad")
    d = replace(d, facts=replace(d.facts, queue=None))
    further = "summary" if d.ends_in_summary else "next step"
    return _say(d, f"{why}. Enter: {further} of this unit", "good", Do.END_QUEUE)


def changed(d: StepDialogue, done: Toast) -> Turn:
    """Go on after an entry was undone, or the step begun once more."""
    return _done(d, done)


def mended(d: StepDialogue, step: str) -> Turn:
    """Begin with the new records of a training, or leave for the step that they belong to."""
    if d.step.derived or step != d.step.name:
        return Turn(d, (do.Leave(step),))
    return Turn(d, (_first_look(d, "mended"),))


def _other_form(d: StepDialogue) -> Turn:
    """Change to the next way of giving the data; what was given another way stays until something new is given."""
    forms = d.step.check.forms
    return Turn(
        replace(d, chosen=True), (do.LookForRecords((forms[(forms.index(d.form) + 1) % len(forms)],), "chosen"),)
    )


_answered: Callable[[StepDialogue, str], Turn] = by_key(
    {
        "enter": _enter,
        "f2": _pick,
        "f3": _read_or_compare,
        "f4": _repeat,
        "f5": lambda d: Turn(d, (Do.ASK_NOTE,)),
        "ctrl+f": _other_form,
        "f8": lambda d: Turn(d, (Do.ASK_REASON,)) if d.facts.state.entries else _say(d, _NO_ENTRIES, "bad"),
        "f9": _keep_or_sum_up,
        "ctrl+k": _keep,
        "f10": lambda d: Turn(d, (do.Settle("same step", judged=True),)),
        "up": lambda d: _move(d, -1),
        "down": lambda d: _move(d, 1),
        "ctrl+d": lambda d: Turn(replace(d, whole=not d.whole)),
        "ctrl+r": lambda d: Turn(d, (Do.ASK_REMEDY,)),
        "ctrl+z": lambda d: Turn(d, (Do.UNDO,)),
    }
)


def press(d: StepDialogue, key: str) -> Turn:
    """Answer a key. While the whole step is measured none of them leaves it, which would lose what was measured."""
    return _say(d, _MEASURING, "bad", Common.BELL) if d.measures and key in d.idle_keys else _answered(d, key)
