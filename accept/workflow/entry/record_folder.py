"""A folder that records arrive in: its files, newest first, and which of them is proposed for which input of a form."""

import os
import re
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from checks.declare import CsvTable, Series

TYPES = {
    ".mat": "MATLAB",
    ".csv": "table",
    ".uff": "UFF",
    ".unv": "UFF",
    ".tdms": "TDMS",
    ".txt": "text",
}
_PHOTOS = {".jpg", ".jpeg", ".png", ".heic", ".webp", ".tif", ".tiff"}
LOOKED_INTO_MOST = 64 * 2**20  # bytes of a file that is looked into unasked
_MOST = 500  # files of one folder
_MOST_PROPOSED = 60  # the newest of them, from which one is proposed
SETTLED_S = 1.5  # a file that changed within it may still be written
_TOGETHER_S = 600.0  # files of one session at the rig; an older one is proposed only without any of these

FileInput = Series | CsvTable
NO_OTHERS: Mapping[str, Sequence[FileInput]] = MappingProxyType({})


@dataclass(frozen=True)
class PickableFile:
    """One file. mtime: seconds of the epoch; fits: whether it has what is wanted; score: how far its name speaks for
    that; other: the step that it speaks for instead, "" for none; damage: why it cannot be read, "" if it can."""

    name: str
    mtime: float
    size: int
    fits: bool = True
    score: int = 0
    other: str = ""
    damage: str = ""


@dataclass(frozen=True)
class Listing:
    """One look at a folder: folders by name, files newest first."""

    folders: tuple[str, ...]
    files: tuple[PickableFile, ...]


def look(
    folder: Path,
    fits: Callable[[Path], bool] = lambda _: True,
    named: Callable[[str], tuple[int, str]] = lambda _: (0, ""),
    first: str = "",
) -> Listing:
    """Return what a folder holds: files that fit before the others, of these the ones whose names speak most for what
    is wanted, then the newest. named: score of a name, and the step that it speaks for instead; first: the file that is
    proposed, which stands on top. Raises OSError."""
    folders, files = _contents(folder)
    judged = []
    for file in files[:_MOST]:
        score, other = named(file.name)
        good = file.size > LOOKED_INTO_MOST or fits(folder / file.name)
        judged.append(replace(file, fits=good, score=score, other=other))
    judged.sort(key=lambda entry: (entry.name != first, not entry.fits, -entry.score))
    return Listing(tuple(folders[:_MOST]), tuple(judged))


def _contents(folder: Path) -> tuple[list[str], list[PickableFile]]:
    with os.scandir(folder) as found:
        seen = [entry for entry in found if not entry.name.startswith(".")]
    folders = sorted(entry.name for entry in seen if os.path.isdir(entry))  # entry.is_dir raises at links in a circle
    files = [entry for entry in seen if os.path.isfile(entry) and Path(entry.name).suffix.lower() in TYPES]
    listed = [PickableFile(entry.name, entry.stat().st_mtime, entry.stat().st_size) for entry in files]
    return folders, sorted(listed, key=lambda entry: (-entry.mtime, entry.name))


def new_photo(folder: Path, within_s: float = _TOGETHER_S) -> str:
    """Return the name of the photo that was written to a folder last, within so many seconds; "" without one."""
    try:
        with os.scandir(folder) as found:
            there = [entry for entry in found if os.path.isfile(entry)]
            photos = [(e.stat().st_mtime, e.name) for e in there if Path(e.name).suffix.lower() in _PHOTOS]
    except OSError:
        return ""
    written, name = max(photos, default=(0.0, ""))
    return name if time.time() - written < within_s else ""


def proposals(
    folder: Path,
    wanted: Sequence[FileInput],
    about: str,
    fits: Callable[[FileInput, Path], bool],
    taken: Callable[[Path, float], bool],
    damage: Callable[[Path], str] = lambda _: "",
    others: Mapping[str, Sequence[FileInput]] = NO_OTHERS,
    given: Collection[str] = (),
) -> dict[str, PickableFile]:
    """Return for each input that wants a file the one that is proposed, by the input's name; no file twice. Without
    one, a file whose name speaks for the input and that cannot be read, with its damage. given: inputs that have a
    file; another one whose name speaks for them is left for them.

    A file is proposed if it has the channels, is written to its end and belongs to no unit yet (taken: by path and
    time). Files of one session at the rig come first, of these the one whose name speaks for the input, then the
    newest. A file whose name speaks more for another input or another step is left for that one. For an optional input
    a file is proposed only if its name speaks for it. about, others: as for `name_score`. A folder that cannot be read
    proposes nothing.
    """
    try:
        files = _contents(folder)[1][:_MOST_PROPOSED]
    except OSError:
        return {}
    now = time.time()
    free = [f for f in files if not 0 <= now - f.mtime < SETTLED_S and f.size <= LOOKED_INTO_MOST]
    free = [replace(f, damage=damage(folder / f.name)) for f in free if not taken(folder / f.name, f.mtime)]
    candidates = [
        (place, declared, replace(file, score=score), _score(file.name, declared, wanted, about))
        for place, declared in enumerate(wanted)
        if declared.name not in given
        for file in free
        for score, step in [name_score(file.name, declared, wanted, about, others)]
        if not step and (file.damage or fits(declared, folder / file.name))
    ]
    newest = max((file.mtime for _, _, file, _ in candidates), default=0.0)
    candidates = [c for c in candidates if c[3] >= (1 if c[1].optional or c[2].damage else 0)]
    candidates.sort(
        key=lambda c: (c[2].damage != "", newest - c[2].mtime > _TOGETHER_S, -c[2].score, -c[3], c[0], -c[2].mtime)
    )
    chosen: dict[str, PickableFile] = {}
    for _, declared, file, _ in candidates:
        if declared.name not in chosen and file.name not in {one.name for one in chosen.values()}:
            chosen[declared.name] = file
    return chosen


def _score(file: str, declared: FileInput, wanted: Sequence[FileInput], about: str) -> int:
    """Return how far the name of a file speaks for an input rather than for another of the form."""
    found = _words(Path(file).stem)
    common = len(found & _words(about))
    own = len(found & _named(declared))
    others = max((len(found & _named(other)) for other in wanted if other is not declared), default=0)
    return own + common if own >= others else own - others


def name_score(
    file: str, declared: FileInput, wanted: Sequence[FileInput], about: str, others: Mapping[str, Sequence[FileInput]]
) -> tuple[int, str]:
    """Return how far the name of a file speaks for an input of a step, less how far it speaks for another step, and
    that step if it speaks more for it, else "". wanted: inputs of the form; about: words of the step; others: words of
    the other steps, the last one its name, and their inputs."""
    found, own = _words(Path(file).stem), _score(file, declared, wanted, about)
    scores = [
        (len(found & _named(one)) + len(found & _words(words)), words.split("\n")[-1])
        for words, inputs in others.items()
        for one in inputs
    ]
    most, name = max(scores, default=(0, ""), key=lambda each: each[0])
    return own - most, name if most > max(own, 0) else ""


def _named(declared: FileInput) -> frozenset[str]:
    return _words(declared.name) | frozenset(getattr(declared, "named", ()))


def _words(name: str) -> frozenset[str]:
    return frozenset(re.findall(r"[a-z]+|[0-9]+", name.lower()))


def age_words(mtime: float, now: float | None = None) -> str:
    """Return when a file was written: how long ago within the hour, else the time, with the day unless it is today."""
    now = time.time() if now is None else now
    passed, then = now - mtime, time.localtime(mtime)
    if 0 <= passed < 3600:
        return f"{passed:.0f} s ago" if passed < 60 else f"{passed / 60:.0f} min ago"
    today = time.strftime("%Y-%m-%d", time.localtime(now))
    return time.strftime("%H:%M" if time.strftime("%Y-%m-%d", then) == today else "%Y-%m-%d %H:%M", then)


Proposals = Mapping[str, PickableFile]
