"""Finished cases of a blind test, a file each, so that a stopped run can be continued.

Every file holds what it was found with: digest of the thresholds, of the code, of the sealed truth of all units, and
the seed of its own. Whatever differs is refused: scores of two versions must not be mixed.
"""

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from validation.scoring.scores import Outcome

ROOT = Path(__file__).parents[2]
THRESHOLDS = ROOT / "checks" / "gap" / "modelling" / "thresholds.py"
CODE = ("checks/**/*.py", "hw/**/*.py", "specs/**/*.py", "accept/**/*.py", "validation/**/*.py")


class Mixed(ValueError):
    """A finished case that was run with other code or data; the text names them."""


@dataclass(frozen=True)
class Stamp:
    """sha256 of the thresholds, of the code that judges and that draws, and of the sealed truth."""

    thresholds: str
    code: str
    sealed: str


def stamp(sealed: str) -> Stamp:
    """Return the stamp of the tree as it is now."""
    parts = [hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted({p for g in CODE for p in ROOT.glob(g)})]
    thresholds = hashlib.sha256(THRESHOLDS.read_bytes()).hexdigest()
    return Stamp(thresholds, hashlib.sha256("".join(parts).encode()).hexdigest(), sealed)


@dataclass(frozen=True)
class Store:
    """The files `NAME.json` of a folder."""

    folder: Path
    stamp: Stamp

    def finished(self, seeds: dict[str, int]) -> dict[str, Outcome]:
        """Return the outcomes that are stored already. seeds: name -> seed of every case that is to be run. Raises
        Mixed."""
        paths = {name: self.folder / f"{name}.json" for name in seeds}
        return {name: self._read(path, seeds[name]) for name, path in paths.items() if path.exists()}

    def _read(self, path: Path, seed: int) -> Outcome:
        stated = json.loads(path.read_text())
        expected = {**asdict(self.stamp), "seed": seed}
        for key, value in expected.items():
            if stated.get(key) != value:
                raise Mixed(
                    f"{path}: {key} is {str(stated.get(key))[:12]}, now {str(value)[:12]}: it was found with another "
                    "version; give --out another folder, or delete the files of this one"
                )
        o = stated["outcome"]
        return Outcome(**{**o, "without": tuple(o["without"])})

    def keep(self, name: str, seed: int, outcome: Outcome) -> None:
        """Write the outcome beside its place and rename it: a run that is killed leaves no half of a file."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{name}.json"
        beside = path.with_suffix(".part")
        beside.write_text(json.dumps({**asdict(self.stamp), "seed": seed, "outcome": asdict(outcome)}, indent=1))
        os.replace(beside, path)
