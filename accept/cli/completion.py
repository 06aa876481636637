"""Names and values for the completion of a shell. Nothing here loads what a command needs: it answers while a key is
held."""

import os
import sqlite3
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import Any

from accept.base.home import HomeError, home
from specs.plugins import products

MOST = 200  # serials that are offered at once
OF_UNITS = ("unit_judged", "attempt_started")  # events
LAST = "\U0010ffff"  # no text is greater
Values = Callable[[Sequence[str], str], Iterable[str]]  # (words before it, its beginning) -> what it may be


def values(kinds: Sequence[str], words: Sequence[str], incomplete: str) -> list[str]:
    """Return what a word of a command may be, nothing for a file's name, which the shell completes itself.

    kinds: of the command's arguments in their order, the last for all that follow; words: those before it."""
    option = words[-1] if words and words[-1].startswith("--") else ""
    if option in OPTIONS:
        kind = OPTIONS[option]
    elif kinds:
        kind = kinds[min(len(_arguments(words)), len(kinds) - 1)]
    else:
        return []
    try:
        return sorted({v for v in VALUES[kind](words, incomplete) if v.startswith(incomplete)})
    except (OSError, ValueError, TypeError, AttributeError, sqlite3.Error, HomeError):
        return []  # a key that completes nothing says enough: the command itself will say why


def _arguments(words: Sequence[str]) -> list[str]:
    """Return the words that are no option, and not the value of an option that is known here."""
    before = ["", *words]
    return [w for last, w in zip(before, words, strict=False) if not w.startswith("-") and last not in OPTIONS]


def _files(*folder: str) -> Iterable[Path]:
    """Return the TOML files of a folder of the package `specs`."""
    import specs

    return Path(specs.__file__).parent.joinpath(*folder).glob("*.toml")


def _sections() -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield name and content of each check in the specs that come with the program."""
    for path in _files():
        yield from tomllib.loads(path.read_text(encoding="utf-8")).get("checks", {}).items()


def _quantities(words: Sequence[str], _incomplete: str) -> list[str]:
    """Return the quantities that these specs limit, and the references of the bench's instruments."""
    limited = [quantity for _, check in _sections() for quantity in check.get("limits", {})]
    return [*limited, *(f"check:{name}" for name in _instruments(words))]


def _instruments(words: Sequence[str]) -> Mapping[str, Mapping[str, Any]]:
    """Return the entries of the bench file that the words name, else of the one in the bench's folder."""
    named = [value for option, value in pairwise(words) if option == "--bench"]
    path = Path(named[-1]) if named else home() / "bench.toml"
    bench = tomllib.loads(path.read_text(encoding="utf-8"))
    return {**bench.get("instruments", {}), **bench.get("recorders", {})}


def _instruments_or_serials(words: Sequence[str], _incomplete: str) -> list[str]:
    entries = _instruments(words)
    return [*entries, *(str(entry["serial"]) for entry in entries.values() if "serial" in entry)]


def _serials(_words: Sequence[str], incomplete: str) -> list[str]:
    """Return the units of the bench's own store; of a server's none: its answer may take long."""
    path = home() / "store.sqlite"
    if os.environ.get("ACCEPT_STORE_URL") or not path.exists():
        return []
    wanted = "SELECT DISTINCT subject FROM events WHERE subject >= ? AND subject < ? AND what IN (?, ?) LIMIT ?"
    with closing(sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True, timeout=1.0)) as store:
        return [str(subject) for (subject,) in store.execute(wanted, (incomplete, incomplete + LAST, *OF_UNITS, MOST))]


VALUES: Mapping[str, Values] = {
    "check": lambda _words, _incomplete: (name for name, _ in _sections()),
    "file": lambda _words, _incomplete: (),
    "instrument": lambda words, _incomplete: _instruments(words),
    "instrument or serial": _instruments_or_serials,
    "model": lambda _words, _incomplete: (path.stem for path in _files("models")),
    "product": lambda _words, _incomplete: products(),
    "quantity": _quantities,
    "serial": _serials,
    "spec": lambda _words, _incomplete: (path.stem for path in _files()),
}
OPTIONS: Mapping[str, str] = {
    "--bench": "file",
    "--check": "check",
    "--instrument": "instrument or serial",
    "--kind": "product",
    "--model": "model",
    "--spec": "spec",
}
