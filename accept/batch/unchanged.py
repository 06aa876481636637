"""Whether a unit was judged before and nothing has changed since: then its result stands, and nothing is done again."""

import hashlib
from pathlib import Path

from accept.base.version import code_sha256
from accept.batch.request import BatchRequest
from accept.gap.start_model import is_there, same_start
from accept.judging import calibration
from accept.judging.copies import copies_of
from accept.judging.parts import part_doubts
from accept.store import Store, UnitState
from accept.units.unit_folder import UnitFolder
from specs.files import CERTIFICATE_BYTES, read_bounded


def unchanged(folder: UnitFolder, request: BatchRequest, known: UnitState, store: Store) -> bool:
    """Whether inputs, spec and code are those of the unit's last judgement, its recordings stand where they stood, its
    parts are what they were, and its certificate, if one is wanted, lies in `out` as it was signed."""
    spec = request.specs[folder.kind]
    if not known.unchanged(folder.input_hashes(), spec.sha256, code_sha256()):
        return False
    if known.result.get("models", {}) != request.model_hashes(folder.kind):
        return False
    if not calibration.same(known.result.get("calibration"), request.calibration(folder)):
        return False
    copies = copies_of(store, folder.serial, str(folder.path.resolve()), known.result.get("samples", {}))
    if copies != known.result.get("copies", []):
        return False
    if part_doubts(store, folder.serial, folder.parts) != known.result.get("part_doubts", []):
        return False
    explanation = known.result.get("gap")
    if not (same_start(explanation, request.start(folder)) and is_there(explanation, request.out)):
        return False
    if request.credential is None:
        return True
    path = request.certificate(folder.serial)
    return known.certificate is not None and _sha256(path) == known.certificate.sha256


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bounded(path, CERTIFICATE_BYTES)).hexdigest()
    except OSError:
        return None
