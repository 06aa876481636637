"""Entries at a unit: values that are typed or read, notes, steps that are measured anew; and entries taken back, by an
event: the record keeps both."""

import io
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.store import Event
from accept.store.payloads import (
    EntryUndone,
    NotedFile,
    ReadingFailed,
    RecordLinked,
    RunOpened,
    StepNoted,
    StepRemeasured,
    ValueTaken,
    nonconformance_in,
    payload_of,
)
from accept.units import attach
from accept.workflow.entry.parse_entry import EntryError, check_plausible, plain_words
from accept.workflow.instruments.port import InstrumentPort, reading
from accept.workflow.session.unit import Subject
from accept.workflow.steps import section
from checks.declare import Input, Measured, Scalar
from hw.errors import InstrumentError
from specs.files import read_bounded

NOTES_FOLDER = "notes"  # in that of an attempt: photos and other files
_FILE_BYTES = 200_000_000  # of one of them
_MOST_PIXELS = 1200  # of the longer side: 150 to the inch on the width of the page
_QUALITY = 80  # of the JPEG; such a picture has 100 to 300 kB


def scaled(path: Path) -> bytes:
    """Return a photo as a small JPEG, upright and without what the camera wrote beside it. Raises EntryError if it is
    no picture, OSError if it cannot be read."""
    from PIL import Image, ImageOps, UnidentifiedImageError  # loads slowly: only when a picture is printed

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(read_bounded(path, _FILE_BYTES))) as photo:
                upright = ImageOps.exif_transpose(photo).convert("RGB")
    except (UnidentifiedImageError, Image.DecompressionBombWarning, Image.DecompressionBombError, ValueError) as e:
        raise EntryError(f"{path.name}: no picture that can be printed; keep it as a file without printing it") from e
    upright.thumbnail((_MOST_PIXELS, _MOST_PIXELS))
    small = io.BytesIO()
    upright.save(small, "JPEG", quality=_QUALITY, optimize=True)
    return small.getvalue()


def keep(picture: bytes, folder: Path, name: str) -> str:
    """Write the scaled picture beside the file that it was made of; return its name."""
    shown = f"{Path(name).stem}.print.jpg"
    number = 1
    while (folder / shown).exists() and (folder / shown).read_bytes() != picture:
        number += 1
        shown = f"{Path(name).stem}.print-{number}.jpg"
    write_atomic(folder / shown, picture, of_unit=True)
    return shown


class Entries(Subject):
    """Stores entries of one unit."""

    def take(
        self,
        step: str,
        declared: Input,
        measured: Measured,
        *,
        index: int | None = None,
        repeat: bool = False,
        text: str = "",
        source: str = "typed",
        day: str | None = None,
        evidence: Mapping[str, Any] | None = None,
    ) -> Event:
        """Store a value in the unit that its input declares. index: place in a vector. repeat: one more reading of the
        same value, not a correction. source: `typed` or the instrument's name; text: what it was read from. day: of
        measuring, if that is not today. evidence: of the instrument, its calibration and its line.

        Raises EntryError if it is not plausible, StoreError."""
        if isinstance(declared, Scalar):
            check_plausible(measured.value, declared)
        form = self._unit.step(step).form_with(declared.name).name
        unit_name = getattr(declared, "unit", "1")
        taken = ValueTaken(
            step, form, declared.name, measured.value, measured.U, unit_name,
            index=index, repeat=repeat, text=text, source=source, day=day, evidence=evidence or None,
        )  # fmt: skip
        return self._unit.append(taken)

    def read(
        self, step: str, declared: Input, instrument: InstrumentPort, *, index: int | None = None, repeat: bool = False
    ) -> Event:
        """Read an instrument and store its value with the traffic of its line; if it gives none, store that.

        Raises InstrumentError, EntryError for a reading that cannot be, StoreError."""
        unit_name = str(getattr(declared, "unit", "1"))
        try:
            measured = reading(instrument, unit_name)
            if isinstance(declared, Scalar):
                check_plausible(measured.value, declared)
        except (InstrumentError, EntryError) as e:
            self._unit.append(ReadingFailed(step, declared.name, str(e), instrument.name, instrument.evidence()))
            raise
        text = f"{measured.value:.9g} {unit_name}"
        return self.take(
            step, declared, measured,
            index=index, repeat=repeat, text=text, source=instrument.name, evidence=instrument.evidence(),
        )  # fmt: skip

    def note(
        self,
        step: str,
        text: str,
        nonconformance: bool = False,
        files: Sequence[Path] = (),
        internal: bool = False,
        printed: bool = False,
    ) -> Event:
        """Keep a note about a step, with copies of its photos or other files. internal: not on the certificate, where
        every nonconformance is; printed: its photos are shown there, scaled. Raises EntryError if it is empty or a
        passphrase, or if a file to print is no picture, OSError if a file cannot be read."""
        words, folder = plain_words(text, "a note"), self._unit.folder / NOTES_FOLDER
        self._unit.refuse([text])
        if (said := nonconformance_in(words)) is not None:  # typed as in unit.toml, where it holds a unit too
            words, nonconformance = said or words, True
        kept = []
        for path in files:
            picture = scaled(path) if printed else b""  # a file that is no picture stops here
            name, digest = attach.copy_in(path, folder, _FILE_BYTES)
            shown = f"{NOTES_FOLDER}/{keep(picture, folder, name)}" if picture else ""
            kept.append(NotedFile(name, digest, str(path), shown))
        return self._unit.append(StepNoted(step, words, nonconformance, tuple(kept), internal and not nonconformance))

    def remeasure(self, step: str, reason: str) -> Event:
        """Begin a step anew; its earlier entries stay in the store. Raises EntryError without a reason, and if it is a
        passphrase."""
        self._unit.refuse([reason])
        return self._unit.append(StepRemeasured(step, plain_words(reason, "the reason")))

    def ever_given(self) -> frozenset[tuple[str, str, int | None]]:
        """Return (step, input, index) of every entry of the present attempt, undone or not."""
        given = (payload_of(e, ValueTaken, RecordLinked) for e in self._unit.events if e.seq > self._unit.begun)
        return frozenset(
            (p.step, p.input, p.index if isinstance(p, ValueTaken) else None)
            for p in given
            if isinstance(p, ValueTaken | RecordLinked)
        )


class Undo(Subject):
    """Takes back entries of one unit."""

    def entry(self, step: str = "") -> Event:
        """Take back the last entry of this attempt. step: only if it belongs to this one. Raises EntryError if there is
        no entry, or one of another step, or a nonconformance, which only quality assurance releases."""
        with self._unit.mutex:
            seqs = self._unit.attempt.undoable
            last = next((e for e in reversed(self._unit.events) if seqs and e.seq == seqs[-1]), None)
            if last is None:
                raise EntryError("there is nothing to undo in this attempt")
            if step and last.data.get("step") != step:
                raise EntryError("the last entry belongs to another step; undo it in the step list")
            if last.what == StepNoted.KIND and (note := StepNoted.of(last)).nonconformance:
                raise EntryError(f"'{note.text}' holds this unit; only quality assurance releases it (F9, then ^T)")
            return self._unit.append(EntryUndone(last.seq))

    def unit(self) -> Event:
        """Take back that this unit was begun, as if its serial had not been entered. Raises EntryError if anything was
        done at it, StoreError."""
        with self._unit.mutex:
            done = {e.what for e in self._unit.events if e.seq > self._unit.begun} - {RunOpened.KIND}
            if done or self._unit.attempt.number > 1:
                raise EntryError(f"{self._unit.serial} stays: something was done at it")
            return self._unit.append(EntryUndone(self._unit.begun))

    def words_of(self, undo: Event) -> str:
        """Return what an event took back, and the step that it belonged to."""
        of = EntryUndone.of(undo).undoes
        event = next(each for each in self._unit.events if each.seq == of)
        return f"{entry_words(event)} ({self._unit.step(str(event.data['step'])).short})"


def entry_words(event: Event) -> str:
    """Return what was entered by an event."""
    match payload_of(event):
        case ValueTaken() | RecordLinked() as entry:
            return section.entry_words(entry)
        case StepNoted() as note:
            return f"note '{note.text}'"
    return "measuring again"
