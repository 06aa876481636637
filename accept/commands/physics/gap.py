"""`accept gap`: where simulation and data disagree, what is missing, and the gap before and after."""

import json
from collections.abc import Sequence
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.base.console import clear_errors, say, tell
from accept.base.exit_codes import Exit
from accept.gap import analyse_unit
from accept.gap.fleet import SETTLED, common, lines
from accept.gap.text import REFUSED, summary
from accept.models.model_file import DEFAULT_MODEL
from accept.units.unit_folder import UNIT_FILE, UnitError, UnitFolder, find, read
from checks.errors import ModelError, RecordError
from checks.gap.effects import EFFECTS
from checks.gap.workflow import GapRefused


@clear_errors
def run(paths: Sequence[Path], model: str | None, out: Path, fleet: bool, without: Sequence[str]) -> Exit:
    """Files of one unit into `out`, of several into a folder each; with fleet, what they have in common as well."""
    unknown = sorted(set(without) - EFFECTS.keys())
    if unknown:
        say(f"accept: --without {', '.join(unknown)}: no such effect (are: {', '.join(EFFECTS)})")
        return Exit.BAD_INPUT
    units = _units(paths)
    out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be written is said before the search, not after
    found = [_one(unit, model, out if len(units) == 1 else out / unit.serial, without) for unit in units]
    done = [each for each in found if each is not None]
    if fleet and done:
        shared = common([each.document for each in done])
        write_atomic(out / "fleet.json", json.dumps(shared, indent=1, allow_nan=False).encode())
        tell(*lines(shared))
        say(f"{out / 'fleet.json'}: written")
    if not done:
        return Exit.BAD_INPUT
    verdicts = {each.result.verdict if each else REFUSED for each in found}
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


def _one(unit: UnitFolder, model: str | None, place: Path, without: Sequence[str]) -> analyse_unit.GapAnalysis | None:
    """The answer for one unit, written and printed; None where it was refused."""
    try:
        start = model or DEFAULT_MODEL[unit.kind]
        done = analyse_unit.analyse(unit, start, without, lambda words: say(f"{unit.serial}: {words}"))
    except (GapRefused, ModelError, RecordError, UnitError) as e:
        words = str(e)
        say(f"accept: {words if words.startswith(f'{unit.serial}:') else f'{unit.serial}: {words}'}")
        return None
    analyse_unit.write(done, place)
    tell(*summary(unit.serial, done.result))
    say(f"{place}: gap.json, gap.pdf and model.toml written")
    return done
