"""The findings of a store as columns in a file, so that a question about many units reads no event again.

The file lies in the bench's folder and can be made again at any time. It ends at an event of the store and is signed
with the bench's own key, like the seal. It is used only if that signature is valid, if the same source made it, if the
store has that event with that hash, and if every column that is read has its SHA-256; else it is rebuilt from the
events. Events after its end are read from the store and added."""

import hashlib
import json
from array import array
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import nullcontext
from datetime import UTC, datetime
from functools import cache
from heapq import merge
from inspect import getfile
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from accept.base.atomic_files import writing_atomic
from accept.base.documents.document import Document
from accept.base.documents.results import ALIKE, CONFIRMED, NAME, UnitRecord
from accept.base.progress import busy
from accept.store import START, TECHNICIAN, Event, Sealer, Store, StoreHead
from accept.store.payloads import CertificateSigned, UnitJudged, payload_of
from checks.verdict import Finding
from specs.files import json_of
from specs.spec import listed_name

KIND = "accept findings"
FEW = 500  # judgements after the end of the file that are read again rather than written
MANY = 5000  # judgements to read that take seconds, so that a bar is shown
LONGEST_HEADER = 1 << 20  # bytes; it has some 10,000
NOT_STATED = "not stated"
OF_ORIGIN = ("lot", "supplier", "order", "shift", "study")
HELD_BY = (  # what holds a whole unit, whatever its values are; the first one counts
    "nonconformance", "copied recording", "part in doubt", "serial in doubt", "no valid calibration",
)  # fmt: skip
NO_TIME = np.iinfo(np.int64).min  # NaT of numpy

TEXT, NUMBER, WHOLE, TIME, TRUTH = "i", "d", "q", "q", "b"  # types of `array`; a text is the number of its word
TEXTS_OF_A_JUDGEMENT = ("operator", "bench", *OF_ORIGIN, "serial", "kind", "unit_verdict", "spec", "held_by")
TEXTS_OF_A_FINDING = ("check", "quantity", "unit", "verdict", "reason", "instrument")
TEXTS = (*TEXTS_OF_A_JUDGEMENT, *TEXTS_OF_A_FINDING)
OF_A_JUDGEMENT = {
    "seq": WHOLE, "time": TIME, "batch": WHOLE, "place": WHOLE, "attempt": WHOLE, "findings": WHOLE, "simulated": TRUTH,
    "typed": TRUTH,  # without a key behind the operator's name
    **dict.fromkeys(TEXTS_OF_A_JUDGEMENT, TEXT),
}  # fmt: skip
OF_A_FINDING = {
    "value": NUMBER, "U": NUMBER, "lower": NUMBER, "upper": NUMBER, "required": TRUTH, "measured": TIME,
    **dict.fromkeys(TEXTS_OF_A_FINDING, TEXT),
}  # fmt: skip
TYPES = OF_A_JUDGEMENT | OF_A_FINDING

# Values; of texts the number of the word, -1 for none, and the words in order.
Column = tuple[np.ndarray, list[str] | None]


class FindingsTable:
    """Columns of judgements (one row each, `findings` counts their findings) and of findings (in the same order)."""

    def __init__(self) -> None:
        """Begin without a row."""
        self.head = START
        self.columns: dict[str, array[Any]] = {name: array(kind) for name, kind in TYPES.items()}
        self.words: dict[str, dict[str, int]] = {name: {} for name in TEXTS}

    def add(self, events: Iterable[Event]) -> None:
        """Add judgements and, to those that their judge signed, that no name was only typed. Raises StoreError."""
        serials = list(self.words["serial"])
        attempts = Counter({serials[code]: n for code, n in Counter(self.columns["serial"]).items()})
        last = {serials[code]: row for row, code in enumerate(self.columns["serial"])}
        for event in events:
            match payload_of(event, UnitJudged, CertificateSigned):
                case UnitJudged() as judged:
                    attempts[event.subject] += 1
                    last[event.subject] = len(self.columns["seq"])
                    self._add(event, judged, attempts[event.subject])
                case CertificateSigned(role=role, typed=False) if role == TECHNICIAN and event.subject in last:
                    row = last[event.subject]
                    if self.columns["operator"][row] == self.words["operator"].get(event.who):
                        self.columns["typed"][row] = False

    def _add(self, event: Event, judged: UnitJudged, attempt: int) -> None:
        result, batch = judged.result, judged.batch
        self._put(
            seq=event.seq, time=_microseconds(event.time),
            batch=batch.seq if batch else event.seq, place=batch.place if batch else 0,
            attempt=attempt, findings=len(result.findings), simulated=result.simulated, typed=judged.typed,
            operator=event.who, bench=bench_of(result),
            **{name: result.origin.get(name, NOT_STATED) for name in OF_ORIGIN},
            serial=event.subject, kind=result.kind, unit_verdict=str(result.verdict),
            spec=listed_name(event.spec), held_by=_held_by(result),
        )  # fmt: skip
        days = {check: _microseconds(day) for check, day in result.measured.items()}
        meters = _instruments(result)
        as_stated = ("check", "quantity", "unit", "reason", "value", "U", "lower", "upper")
        for finding in result.findings:
            self._put(
                **{name: getattr(finding, name) for name in as_stated},
                verdict=str(finding.verdict),
                required=getattr(finding, "required", None) is not False,
                measured=days.get(finding.check, NO_TIME),
                instrument=meters.get(finding.check, NOT_STATED),
            )

    def _put(self, **row: Any) -> None:
        for name, value in row.items():
            if name in self.words:
                words = self.words[name]
                value = -1 if value is None else words.setdefault(value, len(words))
            elif TYPES[name] == NUMBER and value is None:
                value = np.nan
            self.columns[name].append(value)

    def arrays(self, names: Collection[str]) -> dict[str, Column]:
        return {name: self._array(name) for name in names}

    def _array(self, name: str) -> Column:
        """Return the numbers of a column; of a column of texts the ranks in the sorted texts, and those."""
        column = self.columns[name]
        values = np.frombuffer(column, column.typecode) if column else np.empty(0, column.typecode)
        if name not in self.words:
            return values, None
        words = list(self.words[name])
        order = sorted(range(len(words)), key=words.__getitem__)
        rank = np.empty(len(words) + 1, np.int32)
        rank[order], rank[-1] = np.arange(len(words)), -1  # -1, of no text, takes the last
        return rank[values], [words[i] for i in order]


def findings(store: Store, names: Collection[str]) -> dict[str, Column]:
    """Return these columns of all judgements of a store. Raises StoreError."""
    read = _read(store, store.sealer, names) if store.sealer is not None else None
    if read is not None and next(_bearing(store, read[0].seq), None) is None:
        return read[1]
    return _brought_up(store).arrays(names)


def keep_findings(store: Store, judged: int | None = None) -> None:
    """Bring the file up to the end of the store, so that the next question need not. judged: judgements since it was;
    a few are read again rather than written. Raises StoreError."""
    if judged is None or judged > FEW:
        _brought_up(store)


def _brought_up(store: Store) -> FindingsTable:
    """Return the columns up to the end of the store, and write them if more than a few judgements were added."""
    table, head = _load(store), store.head()
    before = len(table.columns["seq"])
    events = takewhile(lambda e: e.seq <= head.seq, _bearing(store, table.head.seq))
    with busy("reading the judgements of the store") if head.seq - table.head.seq > MANY else nullcontext():
        table.add(events)
    table.head = head
    if store.sealer is not None and len(table.columns["seq"]) - before > FEW:
        _write(table, store, store.sealer)
    return table


def _bearing(store: Store, after: int) -> Iterator[Event]:
    """Yield the judgements and signatures behind an event, in order."""
    kinds = (store.events(what=kind, after=after) for kind in (UnitJudged.KIND, CertificateSigned.KIND))
    return merge(*kinds, key=lambda event: event.seq)


def bench_of(result: UnitRecord) -> str:
    """Return the name of the bench file that a result was judged with."""
    calibration = result.calibration or {}
    return str(calibration.get("bench") or NOT_STATED)


def _instruments(result: UnitRecord) -> dict[str, str]:
    """Return check -> the instruments that it was measured with, by their serial numbers."""
    found = dict[str, list[str]]()
    for row in (result.calibration or {}).get("instruments") or ():
        found.setdefault(str(row.get("check")), []).append(str(row.get("serial") or row.get("name")))
    return {check: " and ".join(sorted(set(names))) for check, names in found.items()}


def _held_by(result: UnitRecord) -> str:
    """Return which of `HELD_BY` holds a unit, "" if nothing does."""
    holds = (
        result.nonconformances,
        any(copy.get("withheld") for copy in result.copies),
        result.part_doubts,
        ALIKE in result.folder or (NAME in result.folder and CONFIRMED not in result.folder),
        any(row.get("problem") for row in (result.calibration or {}).get("instruments") or ()),
    )
    return next((words for words, is_so in zip(HELD_BY, holds, strict=True) if is_so), "")


def _microseconds(text: str) -> int:
    """Return a time or day, ISO 8601, as microseconds since 1970; UTC if it states no zone."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return int(NO_TIME)
    aware = found if found.tzinfo else found.replace(tzinfo=UTC)
    since = aware - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds


@cache
def code() -> str:
    """Return the hash of the source that makes the columns of an event: another version rebuilds the file."""
    sources = [__file__, *map(getfile, (Document, UnitRecord, UnitJudged, Finding))]
    return hashlib.sha256(b"".join(Path(source).read_bytes() for source in sources)).hexdigest()


def _path(store: Store, sealer: Sealer) -> Path:
    """Return the file of a store's findings, in the bench's folder: benches that share a store have a key each."""
    named = hashlib.sha256(store.where.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return sealer.key_file.parent / f"findings-{named}.columns"


def _write(made: FindingsTable, store: Store, sealer: Sealer) -> None:
    """Write the file; a bench whose folder cannot be written goes without."""
    parts: dict[str, bytes] = {}
    for name, (values, words) in made.arrays(TYPES).items():
        parts[name] = values.astype(values.dtype.newbyteorder("<")).tobytes()
        if words is not None:
            parts[_words(name)] = json.dumps(words).encode("ascii")
    at, columns = 0, {}
    for name, content in parts.items():
        columns[name] = {"at": at, "size": len(content), "sha256": hashlib.sha256(content).hexdigest()}
        at += len(content)
    header = {"kind": KIND, "code": code(), "head": str(made.head), "columns": columns}
    path = _path(store, sealer)
    try:
        with writing_atomic(path, 0o600) as file:
            file.write(sealer.signed(json.dumps(header)) + b"\n")
            for content in parts.values():
                file.write(content)
    except (OSError, ValueError):
        path.unlink(missing_ok=True)


def _read(store: Store, sealer: Sealer, names: Collection[str]) -> tuple[StoreHead, dict[str, Column]] | None:
    """Return the end of the file and these columns, None if there is no valid file. Raises StoreError."""
    try:
        with _path(store, sealer).open("rb") as file:
            signed = file.readline(LONGEST_HEADER)
            header = json_of(sealer.text_of(signed) or "null")
            head = StoreHead.parse(header["head"])
            if header["kind"] != KIND or header["code"] != code() or not store.holds(head):
                return None

            def content(name: str) -> bytes:
                column = header["columns"][name]
                file.seek(len(signed) + column["at"])
                found = file.read(column["size"])
                if hashlib.sha256(found).hexdigest() != column["sha256"]:
                    raise ValueError(f"{name}: not as it was written")
                return found

            found: dict[str, Column] = {}
            for name in names:
                values = np.frombuffer(content(name), np.dtype(TYPES[name]).newbyteorder("<"))
                found[name] = values, json_of(content(_words(name))) if name in TEXTS else None
            return head, found
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _words(name: str) -> str:
    return f"{name}.words"


def _load(store: Store) -> FindingsTable:
    """Return the whole file, to append to it; without a row if there is no valid file."""
    table = FindingsTable()
    read = _read(store, store.sealer, TYPES) if store.sealer is not None else None
    if read is not None:
        table.head = read[0]
        for name, (values, words) in read[1].items():
            table.columns[name].frombytes(values.astype(TYPES[name]).tobytes())
            if words is not None:
                table.words[name] = {word: code for code, word in enumerate(words)}
    return table
