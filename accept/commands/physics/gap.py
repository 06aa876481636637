"""`accept gap`: where simulation and data disagree, what is missing, and the gap before and after."""

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.base.cluster.connect import connected
from accept.base.cluster.work import GivenUp
from accept.base.console import clear_errors, say, tell
from accept.base.exit_codes import Exit
from accept.base.progress import steps
from accept.base.worker_process import too_large
from accept.gap import analyse_unit
from accept.gap.empirical import lines as lines_of
from accept.gap.fleet import SETTLED, common, lines
from accept.gap.text import REFUSED, summary
from accept.models.model_file import DEFAULT_MODEL, moved
from accept.pictures.formats import PictureError
from accept.pictures.interactive import MISSING
from accept.units.shared_folder import anywhere, not_shared
from accept.units.unit_folder import UNIT_FILE, UnitError, UnitFolder, find, read
from checks.errors import ModelError, RecordError
from checks.gap.effects import EFFECTS
from checks.gap.workflow import GapRefused


@dataclass(frozen=True, eq=False)
class GapQuestion:
    """A unit, the model to start from and effects that are left out."""

    unit: UnitFolder
    model: str
    without: Sequence[str]
    empirical: bool = False
    html: bool = False


@dataclass(frozen=True, eq=False)
class Answer:
    """gap.json, lines for a person, the files by name and the folder they were written for; or only why there is
    none."""

    document: Mapping[str, Any] | None
    words: Sequence[str]
    files: Mapping[str, bytes]
    place: Path = Path()


@clear_errors
def run(
    paths: Sequence[Path],
    model: str | None,
    out: Path,
    fleet: bool,
    without: Sequence[str],
    where: str | None = None,
    empirical: bool = False,
    html: bool = False,
) -> Exit:
    """Files of one unit into `out`, of several into a folder each; with fleet, what they have in common as well.
    where: a cluster that does the work."""
    unknown = sorted(set(without) - EFFECTS.keys())
    if unknown:
        say(f"accept: --without {', '.join(unknown)}: unknown effect (known: {', '.join(EFFECTS)})")
        return Exit.BAD_INPUT
    if html and find_spec("plotly") is None:
        raise PictureError(MISSING)
    units = _units(paths)
    out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be written is said before the search, not after
    asked = [GapQuestion(u, model or DEFAULT_MODEL[u.kind], without, empirical, html) for u in map(anywhere, units)]
    found: dict[str, Mapping[str, Any] | None] = {}
    with connected(where, say) as cluster:
        answers = cluster.unordered(answer, asked) if cluster else ((q, answer(q)) for q in asked)
        for question, given in steps(answers, "gap analysis", len(asked)):
            serial = question.unit.serial
            found[serial] = _kept(serial, given, out if len(units) == 1 else out / serial)
    done = [document for unit in units if (document := found[unit.serial]) is not None]
    if fleet and done:
        shared = common(done)
        write_atomic(out / "fleet.json", json.dumps(shared, indent=1, allow_nan=False).encode())
        tell(*lines(shared))
        say(f"{out / 'fleet.json'}: written")
    if not done:
        return Exit.BAD_INPUT
    verdicts = {each["verdict"] if each else REFUSED for each in found.values()}
    return Exit.ACCEPTED if verdicts <= set(SETTLED) else Exit.INCOMPLETE


def _units(paths: Sequence[Path]) -> list[UnitFolder]:
    """Units at or below the paths. Raises UnitError, for a serial that two of them have too."""
    units = {folder.resolve(): read(folder) for path in paths for folder in find(path)}
    by_serial: dict[str, Path] = {}
    for unit in units.values():
        if unit.serial in by_serial:
            also = f"serial = '{unit.serial}' is also that of {by_serial[unit.serial]}; serials must be unique"
            raise UnitError(unit.path / UNIT_FILE, [also])
        by_serial[unit.serial] = unit.path
    return list(units.values())


def answer(question: GapQuestion) -> Answer:
    """The answer for one unit, here or in a worker."""
    unit = question.unit
    if problem := not_shared(unit):
        return Answer(None, [problem], {})
    try:
        done = analyse_unit.analyse(
            unit, question.model, question.without, lambda words: say(f"{unit.serial}: {words}")
        )
    except (GapRefused, ModelError, RecordError, UnitError) as e:
        return Answer(None, [str(e)], {})
    except MemoryError:
        return Answer(None, [too_large()], {})
    with tempfile.TemporaryDirectory(prefix="accept-") as place:
        added = analyse_unit.write(done, Path(place), question.empirical, question.html)
        files = {path.name: path.read_bytes() for path in Path(place).iterdir()}
        here = Path(place).resolve()
    return Answer(done.document, [*summary(unit.serial, done.result), *lines_of(added)], files, here)


def _kept(serial: str, given: Answer | GivenUp, place: Path) -> Mapping[str, Any] | None:
    """gap.json, when its files are written and it is said; None where the unit was refused, which is said too."""
    if isinstance(given, GivenUp):
        given = Answer(None, [str(given)], {})
    if given.document is None:
        (words,) = given.words
        say(f"accept: {words if words.startswith(f'{serial}:') else f'{serial}: {words}'}")
        return None
    for name, content in given.files.items():
        own = moved(content, given.place, place) if Path(name).suffix == ".toml" else content
        write_atomic(place / Path(name).name, own)
    tell(*given.words)
    say(f"{place}: {', '.join(sorted(given.files))} written")
    return given.document
