"""Frequency responses in files of this program and of others: universal files (data set 58 of type 4), MATLAB, tables,
the JSON of `accept frf`.

    found = read_response_file(Path("analyser.uff"))
    found.f, found.H, found.channels, found.input, found.units, found.said

What a file states is used or the file is refused; what it does not state - noise, coherence, units - is NaN or empty
and never filled in."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from pathlib import Path

from checks.errors import RecordError
from hw.records.clocks import is_time
from hw.records.damage import DAMAGE, refused
from hw.records.responses.arrays import arrays_of
from hw.records.responses.file import ResponseFile
from hw.records.responses.matlab import read_matlab
from hw.records.responses.own_json import read_json
from hw.records.responses.table import has_complex, heads_of, read_table
from hw.records.responses.units import axis_unit, is_frequency_unit
from hw.records.responses.universal import read_universal
from hw.records.source import TDMS, Source, load_bytes
from hw.records.uff import set58 as uff58
from hw.records.uff.set58 import DELIMITER, TIME
from specs.units import parse_header

__all__ = ["Content", "ResponseFile", "read_response_file"]


class Content(Enum):
    """Axes in a file: a record over time, a response over frequencies, or both."""

    RECORD = "record"
    RESPONSE = "response"
    BOTH = "both"

    @classmethod
    def of(cls, path: Path, input: str = "") -> "Content":
        """Return the axes in a file. input: a channel that its record would have. An unreadable file, or one with
        neither axis, counts as a record, whose reader gives the reason."""
        try:
            return _content(load_bytes(path), ("Va", input))
        except (RecordError, *DAMAGE):
            return Content.RECORD


def read_response_file(path: Path, input: str = "", names: Mapping[str, str] | None = None) -> ResponseFile:
    """Return the responses of a file. input: its name if the file states none, or the wanted one of several; names:
    channel here -> name in the file, "f" for the frequencies. Raises RecordError with the file's contents."""
    source = load_bytes(path)
    there = {theirs: here for here, theirs in (names or {}).items()}
    with refused(source.file):
        if DELIMITER.match(source.raw):
            found = read_universal(source, input)
        elif source.suffix == ".json":
            found = read_json(source)
        elif source.is_text:
            found = read_table(source, input, there)
        else:
            found = read_matlab(source, input, there)
    channels = tuple(there.get(c, c) for c in found.channels)
    if len(set(channels)) < len(channels):
        raise RecordError(f"{source.file}: two responses have one name: {', '.join(channels)}; use --map HERE=THERE")
    units = {there.get(c, c): unit for c, unit in found.units.items()}
    return replace(found, channels=channels, units=units)


def _content(source: Source, channels: Sequence[str]) -> Content:
    if source.suffix == ".json":
        return Content.RESPONSE
    if DELIMITER.match(source.raw):
        kinds = {f.kind == TIME for f in uff58.functions(source.file, source.raw)}
        return _of(True in kinds, False in kinds)
    if source.is_text:
        if has_complex(source):
            return Content.RESPONSE
        names = [parse_header(head) for head in heads_of(source)]
        over = any(axis_unit(name) is not None or is_frequency_unit(unit) for name, unit in names)
        return _of(any(is_time(name) or name in channels for name, _ in names), over)
    if source.raw.startswith(TDMS):
        return Content.RECORD
    arrays = arrays_of(source)
    last = [name.rpartition(".")[2] for name in arrays]
    over = any(x.dtype.kind == "c" for x in arrays.values()) or any(axis_unit(n) is not None for n in last)
    return _of(any(is_time(n) or n in channels for n in last), over)


def _of(time: bool, frequency: bool) -> Content:
    return Content.BOTH if time and frequency else Content.RESPONSE if frequency else Content.RECORD
