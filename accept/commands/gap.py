"""`accept gap`: where simulation and data disagree, what is missing, and the gap before and after."""

import json
from collections.abc import Sequence
from pathlib import Path

from accept import gap
from accept.commands.model import DEFAULT_MODEL
from accept.commands.talk import clear_errors, say
from accept.exit import Exit
from accept.files import write_atomic
from accept.fleet import common
from accept.gap_words import summary
from accept.unit import read
from checks.gap.result import EXPLAINED, NO_MISSING
from checks.gap.workflow import GapRefused
from checks.model.superelement import ModelError

SETTLED = (NO_MISSING, EXPLAINED)


@clear_errors
def run(units: Sequence[Path], model: str | None, out: Path, fleet: bool, without: Sequence[str]) -> Exit:
    """Files of one unit into `out`, of several into a folder each; with fleet, what they have in common as well."""
    verdicts, documents = [], []
    for folder in units:
        done = _one(folder, model, out if len(units) == 1 else None, out, without)
        if done is None:
            verdicts.append("refused")
            continue
        documents.append(done.document)
        verdicts.append(done.result.verdict)
    if fleet and documents:
        found = common(documents)
        write_atomic(out / "fleet.json", json.dumps(found, indent=1, allow_nan=False).encode())
        for entry in found["common"]:
            print(f"in all {len(documents)} units: {entry['effect']} - of the bench rather than of a strut")
        print(f"{out / 'fleet.json'}")
    if all(v == "refused" for v in verdicts):
        return Exit.BAD_INPUT
    return Exit.ACCEPTED if set(verdicts) <= set(SETTLED) else Exit.INCOMPLETE


def _one(folder: Path, model: str | None, own: Path | None, out: Path, without: Sequence[str]) -> gap.Done | None:
    """The answer for one unit, written and printed; None where it was refused."""
    unit = read(folder)
    try:
        done = gap.analyse(folder, model or DEFAULT_MODEL[unit.kind], without, lambda w: say(f"{unit.serial}: {w}"))
    except (GapRefused, ModelError) as e:
        say(f"accept: {unit.serial}: {e}")
        return None
    place = own or out / unit.serial
    gap.write(done, place)
    print("\n".join(summary(unit.serial, done.result)))
    say(f"{place}: gap.json, gap.pdf and model.toml written")
    return done
