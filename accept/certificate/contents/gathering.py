"""The content of the certificate of a judged unit, gathered from its folder."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from accept.base.documents.manifest import hashes
from accept.base.documents.results import UnitRecord
from accept.certificate.contents.content import RESERVED, SIZE_LIMIT, CertificateContent, ContentError, within_bounds
from accept.certificate.contents.provenance import Provenance
from accept.models.evidence import evidence_of
from specs.files import UNIT_FILE, read_bounded
from specs.spec import Spec

_NOTHING: Mapping[str, bytes] = {}


def content_of(
    result: UnitRecord,
    spec: Spec,
    folder: Path,
    operator: str,
    size_limit: int = SIZE_LIMIT,
    held: Mapping[str, bytes] = _NOTHING,
    provenance: Provenance | Mapping[str, Any] | None = None,
) -> CertificateContent:
    """Return the content of the certificate of a judged unit in its folder; reads only the inputs that fit into
    `size_limit` bytes, small ones first.

    held : files that were read already, by name. Raises ContentError if an input is gone or is not the one judged, or
    the result is too large.
    """
    files, sizes = _read(folder, result.inputs, size_limit, held)
    models = evidence_of(result.models)
    stated = provenance.to_json() if isinstance(provenance, Provenance) else provenance or {}
    if hashes(models) != {name: dict(files) for name, files in result.models.items()}:
        raise ContentError(f"{', '.join(result.models)}: a model file changed since the unit was judged by it")
    return CertificateContent(
        result=within_bounds(result.to_json()), spec_name=spec.name, spec_title=spec.title, spec_text=spec.text,
        operator=operator,
        instruments=spec.instruments, panels=result.panels, files=files, inputs=dict(sorted(result.inputs.items())),
        sizes=dict(sorted(sizes.items())), models=models, provenance=stated,
    )  # fmt: skip


def _read(
    folder: Path, inputs: Mapping[str, str], size_limit: int, held: Mapping[str, bytes]
) -> tuple[dict[str, bytes], dict[str, int]]:
    files: dict[str, bytes] = {}
    left = size_limit
    try:
        wanted = [name for name in inputs if name not in RESERVED]
        sizes = {name: len(held[name]) if name in held else (folder / name).stat().st_size for name in wanted}
        for name in sorted(sizes, key=lambda n: (n != UNIT_FILE, sizes[n], n)):
            if name == UNIT_FILE or sizes[name] <= left:
                files[name] = held[name] if name in held else read_bounded(folder / name, max(sizes[name], 1))
                left -= len(files[name])
    except OSError as e:
        raise ContentError(f"{e.filename}: cannot be attached ({e.strerror})") from e
    changed = [name for name, content in files.items() if hashlib.sha256(content).hexdigest() != inputs[name]]
    if changed:
        raise ContentError(f"{folder / changed[0]}: changed since it was judged")
    return files, sizes
