"""Reads `unit.toml` of a unit folder, strictly, as the checks declare. `LoadedUnit` reads the files it names."""

import difflib
import errno
import hashlib
import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from pathlib import Path
from socket import gethostname
from typing import Any, TypeVar

from accept.base.documents.results import UnitHeader
from accept.base.plain_text import as_utf8
from accept.units import folder_header
from accept.units.unit_entry import Experiments, UnitSection, experiments_of, section_of
from checks.acceptance import CHECKS, RESERVED
from checks.declare import Check, Series
from checks.errors import RecordError
from hw.records import DEFAULT_LIMITS
from specs.bench import TIME, Channels
from specs.errors import ProblemsError
from specs.files import UNIT_FILE as UNIT_FILE
from specs.files import read_bounded, size_problems, vet_regular
from specs.strict import toml_of

EARLIEST = date(2000, 1, 1)  # of a measurement; clocks that lost power count from 1970 or 1980
_FAULTS = {
    errno.ENOENT: "is a link to a file that is not there",
    errno.ELOOP: "is a link that leads in a circle",
    errno.EACCES: "cannot be read: Permission denied",
}
T = TypeVar("T")
MAX_UNIT_TOML_BYTES = 1_000_000  # files of a person or a rig are a thousandth of it


class UnitError(ProblemsError):
    """An unusable `unit.toml`: its problems, with file, key and expected value."""

    between = "; "


@dataclass(frozen=True, eq=False)
class UnitFolder:
    """A unit as its folder states it. channels: our channel name -> source in the lab's record files; measured: section
    -> day of the measurement, if stated; notes: check -> its notes; experiments: responses under other conditions;
    pictures: check -> files printed on the certificate; sizes: of its files [bytes] on the machine that hands it to
    another one (`anywhere`)."""

    path: Path
    text: bytes
    header: UnitHeader
    channels: Channels = field(default_factory=dict)
    sections: Mapping[str, UnitSection[Check]] = field(default_factory=dict)
    measured: Mapping[str, date] = field(default_factory=dict)
    notes: Mapping[str, Sequence[str]] = field(default_factory=dict)
    experiments: Experiments = field(default_factory=dict)
    pictures: Mapping[str, Sequence[str]] = field(default_factory=dict)
    sizes: Mapping[str, int] | None = None

    @property
    def serial(self) -> str:
        return self.header.serial

    @property
    def kind(self) -> str:
        return self.header.kind

    @property
    def files(self) -> list[str]:
        sections: list[UnitSection[Any]] = [*self.sections.values(), *self.experiments.values()]
        pictures = (name for names in self.pictures.values() for name in names)
        return sorted({name for section in sections for name in section.files} | set(pictures))

    def input_hashes(self) -> dict[str, str]:
        """Return file name -> sha256 of `unit.toml` and of every readable named file."""
        found = {name: read_named(self.path, name, file_hash) for name in self.files}
        return {UNIT_FILE: hashlib.sha256(self.text).hexdigest()} | {n: h for n, h in found.items() if h is not None}


def find(path: Path) -> list[Path]:
    """Return the unit folders at or below a path, sorted. Raises UnitError if there is no unit."""
    if not path.exists():
        raise UnitError(path, ["does not exist; a unit folder or a parent of unit folders was expected"])
    if not path.is_dir():
        raise UnitError(path, ["is a file; a unit folder or a parent of unit folders was expected"])
    # Not by `rglob`: a `unit.toml` that is a link to nothing would be left out without a word.
    folders = sorted(Path(place) for place, inner, files in os.walk(path) if UNIT_FILE in (*inner, *files))
    if not folders:
        raise UnitError(path, [f"holds no {UNIT_FILE}, neither itself nor in any folder below"])
    return folders


def read(folder: Path, latest: date | None = None) -> UnitFolder:
    """Return the unit of a folder. latest: the last day that a measurement may state; None: tomorrow, for a laboratory
    east of this clock. Raises UnitError with every problem of `unit.toml` and of its files; none of these is opened."""
    path = folder / UNIT_FILE
    whole = os.path.realpath(folder)  # of links in a circle too
    if (shown := as_utf8(whole)) != whole:
        raise UnitError(Path(shown), ["the path is not UTF-8, so no store can hold it; give the folder another name"])
    if not folder.is_dir():
        raise UnitError(folder, [f"{'is a file' if folder.exists() else 'does not exist'}; expected a unit folder"])
    text = _read_text(path)
    try:
        data = toml_of(text)
    except ValueError as e:
        raise UnitError(path, [str(e)]) from e
    unit = parse(folder, text, data)
    today = date.today()
    wrong = [
        f"[measured] {name} = {day} lies in the future, today is {today}: correct the day, or this machine's clock"
        for name, day in unit.measured.items()
        if day > (latest or today + timedelta(days=1))
    ] + [
        f"[measured] {name} = {day} lies before {EARLIEST.year}: correct the day"
        for name, day in unit.measured.items()
        if day < EARLIEST
    ]
    if wrong := [*wrong, *_unreadable(unit)]:
        raise UnitError(path, wrong)
    return unit


def _unreadable(unit: UnitFolder) -> Iterator[str]:
    """Yield the problems of the file in the place of each name."""
    for name in unit.files:
        try:
            inside(unit.path, name)
        except UnitError as e:
            yield from e.problems
        except RecordError:
            pass  # said with the findings, here as elsewhere


def _read_text(path: Path) -> bytes:
    try:
        return read_bounded(path, MAX_UNIT_TOML_BYTES)
    except OSError as e:
        if not path.exists() and (last := last_attempt(path.parent, UNIT_FILE)) is not None:
            raise UnitError(path, [f"is not there, the folder holds attempts; the last one: {last}"]) from e
        raise UnitError(path, [f"cannot be read: {e.strerror}"]) from e


def parsed(text: bytes) -> UnitFolder:
    """Return the unit of a `unit.toml` without its folder. Raises UnitError, ValueError."""
    if len(text) > MAX_UNIT_TOML_BYTES:
        raise ValueError(f"it has {len(text)} bytes, at most {MAX_UNIT_TOML_BYTES} are read")
    return parse(Path(), text, toml_of(text))


def parse(folder: Path, text: bytes, data: Mapping[str, Any]) -> UnitFolder:
    """Return unit of a parsed `unit.toml`. Raises UnitError listing every problem."""
    problems = size_problems(data)
    if problems:
        raise UnitError(folder / UNIT_FILE, problems)
    header = folder_header.header_of(data, problems)
    channels = folder_header.channels_of(data, problems)
    known_channels = record_channels() if channels else []  # every check is loaded for it
    problems += [
        f"[channels] {key}: no check reads a channel of this name{_meant(key, known_channels)}"
        f" (known: {', '.join(known_channels)})"
        for key in channels
        if key not in known_channels
    ]
    by_check = {key: folder_header.by_check(data, key, problems) for key in folder_header.BY_CHECK}
    experiments = experiments_of(data, header.kind, problems)
    sections = {}
    for name, content in data.items():
        if name in RESERVED:
            continue
        if name not in CHECKS or CHECKS[name].reads != name:
            known = ", ".join(own for own, check in CHECKS.items() if check.reads == own)
            problems.append(f"[{name}] unknown section or key{_meant(name, CHECKS)} (known: {known})")
        elif not isinstance(content, dict):
            problems.append(f"{name} = {content!r}: expected a section [{name}]")
        else:
            sections[name] = _section(CHECKS.of_kind(name, header.kind), content, problems)
    if problems:
        raise UnitError(folder / UNIT_FILE, problems)
    return UnitFolder(
        folder, text, header, channels, sections, by_check["measured"], by_check["notes"], experiments,
        by_check["pictures"],
    )  # fmt: skip


def record_channels() -> list[str]:
    """Return names, here, of every channel that a check may read from a record."""
    series = [i for check in CHECKS.values() for i in check.inputs.values() if isinstance(i, Series)]
    steps = [one.step for one in series if one.step is not None]
    channels = [name for one in series for name in (*one.channels, *one.optional_channels)]
    return list(dict.fromkeys([*channels, *steps, TIME]))


def _meant(name: str, known: Iterable[str]) -> str:
    """Return `; did you mean 'stroke'?` if a known name is similar."""
    folded = {one.casefold(): one for one in known}
    near = difflib.get_close_matches(name.casefold(), list(folded), 1)
    return f"; did you mean '{folded[near[0]]}'?" if near else ""


def _section(check: Check, content: Mapping[str, Any], problems: list[str]) -> UnitSection[Check]:
    known = check.inputs
    unknown = [key for key in content if key not in known]
    if unknown:
        problems.extend(
            f"[{check.name}] {k}: unknown key{_meant(k, known)} (known: {', '.join(known)})" for k in unknown
        )
        return UnitSection(check, {})
    if not any(content.keys() <= {i.name for i in form.inputs} for form in check.forms):
        ways = " or ".join(f"{{{', '.join(i.name for i in form.inputs)}}}" for form in check.forms)
        problems.append(f"[{check.name}] mixes ways of giving its data: expected {ways}")
    return section_of(check, f"[{check.name}]", known, content, problems)


def inside(folder: Path, name: str) -> Path:
    """Return the path of a named file, which need not be there.

    Raises RecordError if the name is no file of the unit on any machine, because evidence travels with its unit.
    Raises UnitError if something else than a readable file within the unit is there: a certificate would be judged
    again without it, with another reason."""
    if "\\" in name or ":" in name:
        raise RecordError(f"{name}: a file name holds no backslash and no colon; a folder is written with '/'")
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise RecordError(f"{name} lies outside the unit folder; copy the file into it")
    path = _as_stored(folder, name)
    try:
        real = os.path.realpath(path, strict=True)
        vet_regular(os.stat(real), DEFAULT_LIMITS.max_bytes, path)
        if not Path(real).is_relative_to(os.path.realpath(folder)):
            raise OSError(errno.EXDEV, "is a link that leads outside the unit folder")
        if not os.access(path, os.R_OK):
            raise PermissionError(errno.EACCES, "")
    except OSError as e:
        if e.errno == errno.ENAMETOOLONG:
            raise RecordError(f"{name[:60]}: cannot be a file of the unit: {e.strerror}") from e
        if e.errno in (errno.ENOENT, errno.ENOTDIR) and not path.is_symlink():
            return path
        told = _FAULTS.get(e.errno or 0, e.strerror)
        words = f"{name} {told}; put a readable file there, or take its line out"
        raise UnitError(folder / UNIT_FILE, [words]) from e
    return path


def read_named(folder: Path, name: str, read: Callable[[Path], T]) -> T | None:
    """Return what `read` makes of a named file, None if it is not there or its name is refused with the findings.
    Raises UnitError if it cannot be read."""
    try:
        path = inside(folder, name)
    except RecordError:
        return None
    try:
        return read(path) if path.exists() else None
    except (OSError, RecordError) as e:
        raise UnitError(folder / UNIT_FILE, [f"{name}: {e}"]) from e


def _as_stored(folder: Path, name: str) -> Path:
    """Return the path of a file under its name in another form of Unicode: macOS decomposes umlauts."""
    path = folder / name
    with suppress(OSError, ValueError):
        if not path.exists():
            same = unicodedata.normalize("NFC", path.name)
            return next((p for p in path.parent.iterdir() if unicodedata.normalize("NFC", p.name) == same), path)
    return path


def file_hash(path: Path) -> str:
    """Return sha256 of a file. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def anywhere(unit: UnitFolder) -> UnitFolder:
    """Return the unit by a path that means the same to every process, with the sizes of its files as seen from here."""
    there = replace(unit, path=unit.path.resolve())
    return replace(there, sizes=_sizes(there))


def _sizes(unit: UnitFolder) -> dict[str, int]:
    files = {name: unit.path / name for name in (UNIT_FILE, *unit.files)}
    return {name: path.stat().st_size for name, path in files.items() if path.is_file()}


def vet_shared(unit: UnitFolder) -> None:
    """Raise UnitError if work on a unit would be in vain here, because its folder does not look as it did from the
    other machine: without its files it would only seem incomplete."""
    if unit.sizes is not None and unit.sizes != _sizes(unit):
        words = "its files are not there, or are others; share the folder under this path with every worker"
        raise UnitError(unit.path, [f"as seen from {gethostname()}, {words}"])


_NAME = re.compile(r"attempt-(\d+)")


def attempt_folder(number: int) -> str:
    """Return the name of the folder of an attempt."""
    return f"attempt-{number}"


def attempt_number(folder: str) -> int | None:
    """Return the number of the attempt whose folder has this name, None for another folder."""
    found = _NAME.fullmatch(folder)
    return None if found is None else int(found[1])


def last_attempt(unit: Path, file: str) -> Path | None:
    """Return the folder of the last attempt of a unit that holds a file, None without any."""
    numbers = {attempt_number(path.parent.name): path.parent for path in unit.glob(f"*/{file}")}
    last = max((number for number in numbers if number is not None), default=None)
    return None if last is None else numbers[last]
