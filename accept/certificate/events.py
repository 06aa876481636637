"""What judging leaves in the event store, the same for batch, report and workflow."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

from accept.base.version import code_sha256
from accept.fleet.golden import may_judge
from accept.judging.result import UnitResult
from accept.store import Event, Store


def judged(store: Store, folder: Path, result: UnitResult, who: str) -> Event:
    """Store a unit's result, as results.json has it, with all that it depends on: inputs, spec, code.

    Raises BenchStopped where the golden units were missed: no way to a verdict goes round this; StoreError."""
    may_judge(store, result.serial)
    entry = result.to_json()
    payload = {
        "path": str(folder.resolve()),
        "inputs": entry["inputs"],
        "spec_sha256": result.spec_sha256,
        "code_sha256": code_sha256(),
        "result": entry,
    }
    return store.append("unit_judged", result.serial, payload, who=who, spec=result.spec)


def refused(store: Store, path: Path | str, reason: str, who: str) -> Event:
    """Store that a folder, here or at an address, could not be judged at all."""
    return store.append("unit_refused", "", {"path": str(path), "reason": reason}, who=who)


def signed(
    store: Store,
    serial: str,
    path: Path,
    content: bytes,
    role: str,
    *,
    who: str,
    spec: str = "",
    disposition: Mapping[str, str] | None = None,
) -> Event:
    """Store that a certificate was signed in a role and written to `path`, with the disposition of a unit that was not
    accepted."""
    what = {"path": str(path.resolve()), "sha256": hashlib.sha256(content).hexdigest(), "role": role}
    decided = {} if disposition is None else {"disposition": disposition}
    return store.append("certificate_signed", serial, what | decided, who=who, spec=spec)
