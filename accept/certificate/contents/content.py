"""The content of a certificate: gathered from the folder of a judged unit, and the files in the PDF that hold it."""

import hashlib
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import metadata
from typing import Any

from accept.base import version
from accept.base.documents.document import DocumentError
from accept.base.documents.manifest import MODEL_FOLDER, AttachedSpec, InputFile, JudgingProgram, Manifest, ModelFiles
from accept.base.documents.results import UnitRecord
from accept.certificate.contents.outcome import InvalidCertificate
from accept.certificate.contents.provenance import Provenance
from accept.pictures.jsonform import panels_from_json, panels_to_json
from accept.pictures.reduce import reduce_panel
from checks.picture import Panel
from specs.errors import AcceptError
from specs.files import UNIT_FILE, json_of, size_problems
from specs.strict import toml_of

FORMAT = 2
BEFORE = 1  # states neither the sizes of its inputs, nor its attempt, nor the head of the store
RESULTS, MANIFEST, SPEC, PANELS = "results.json", "manifest.json", "spec.toml", "panels.json"
RESERVED = (RESULTS, MANIFEST, SPEC, PANELS)
MOST_ENTRIES, MOST_LETTERS = 2_000, 1_000_000  # of an entry of the result: its page and comparisons end within seconds
SIZE_LIMIT = 20_000_000  # bytes of records in one certificate
STATEMENT = (
    "Each verdict holds for the value and the expanded uncertainty U (k = 2) beside it, under the decision rule named "
    "there; values are compared unrounded and shown to two digits of U. P(false) is the probability that the true "
    "value lies outside the limits although it was accepted (JCGM 106). Valid for the condition of the unit "
    "when measured."
)


class ContentError(AcceptError, ValueError):
    """A certificate that cannot be made; the text names what is wrong."""


def renderer() -> dict[str, str]:
    """Return name -> version of the programs that decide the bytes of a drawn page and of its signatures."""
    return {name: metadata.version(name) for name in ("pillow", "pyhanko", "pypdf", "reportlab")} | {
        "zlib": zlib.ZLIB_RUNTIME_VERSION
    }


@dataclass(frozen=True, eq=False)
class CertificateContent:
    """The content of a certificate. Equal contents give equal bytes.

    result : the unit's entry in results.json (`UnitRecord.to_json()`). panels : pictures by name.
    files : input files to attach, by their names in the unit folder (`unit.toml` first of all).
    inputs : sha256 of every input, also of those too large to attach; sizes : their bytes. models : model files that
    the spec names, by that name. provenance : as it is attached, which the bench signs; `stated` is its typed form.
    instruments : check -> words of the spec.
    code_sha256, drawn_with : which program judged and drew; they say whether the page can be drawn again to the byte.
    """

    result: Mapping[str, Any]
    spec_name: str
    spec_title: str
    spec_text: str
    operator: str
    instruments: Mapping[str, str] = field(default_factory=dict)
    panels: Mapping[str, Panel] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    sizes: Mapping[str, int] = field(default_factory=dict)
    models: Mapping[str, ModelFiles] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    format: int = FORMAT
    statement: str = STATEMENT
    accept_version: str = field(default_factory=version.program)
    code_sha256: str = field(default_factory=version.code_sha256)
    drawn_with: Mapping[str, str] = field(default_factory=renderer)

    @cached_property
    def pictures(self) -> dict[str, Panel]:
        """Return the panels, reduced to what print can show."""
        return {name: reduce_panel(panel) for name, panel in self.panels.items()}

    @cached_property
    def unit_file(self) -> dict[str, Any]:
        """Return the content of the attached unit.toml, {} without it. Raises ValueError if it is not TOML."""
        return toml_of(self.files[UNIT_FILE]) if UNIT_FILE in self.files else {}

    @cached_property
    def stated(self) -> Provenance:
        """Return the provenance as it is declared. Raises InvalidCertificate if a statement does not have its form."""
        try:
            return Provenance.from_json(dict(self.provenance))
        except DocumentError as e:
            raise InvalidCertificate("; ".join(f"provenance: {line}" for line in str(e).splitlines())) from e

    @cached_property
    def record(self) -> UnitRecord:
        """Return the result as it is declared. Raises DocumentError if it does not have that form."""
        return UnitRecord.from_json(self.result)

    @property
    def serial(self) -> str:
        return str(self.result["serial"])

    @property
    def simulated(self) -> bool:
        """Whether no instrument measured the unit; then every page says so."""
        return bool(self.result.get("simulated"))

    @property
    def spec_sha256(self) -> str:
        return _sha256(self.spec_text.encode())

    @property
    def spec_with_hash(self) -> str:
        """Return name@sha256 of the attached spec, as events and results state it."""
        return f"{self.spec_name}@{self.spec_sha256}"

    @cached_property
    def results_json(self) -> bytes:
        """Return the attached results.json, which is the result in canonical form."""
        return canonical(self.result)

    @cached_property
    def record_sha256(self) -> str:
        return _sha256(self.results_json)

    def manifest(self) -> dict[str, Any]:
        """Return the statements that are not in the other attachments, and the hash of every input."""
        return Manifest(
            format=self.format,
            serial=self.serial,
            record_sha256=self.record_sha256,
            accept=JudgingProgram(self.accept_version, self.code_sha256),
            drawn_with=self.drawn_with,
            spec=AttachedSpec(self.spec_name, self.spec_title, self.spec_sha256),
            operator=self.operator,
            instruments=self.instruments,
            statement=self.statement,
            inputs={
                name: InputFile(digest, name in self.files, self._size(name)) for name, digest in self.inputs.items()
            },
            models={name: tuple(files) for name, files in sorted(self.models.items())},
            provenance=self.provenance,
        ).to_json()

    def _size(self, name: str) -> int | None:
        return len(self.files[name]) if name in self.files and name in self.sizes else self.sizes.get(name)

    def attachments(self) -> dict[str, bytes]:
        """Return name -> content of every file inside the PDF, sorted."""
        own = {
            RESULTS: self.results_json,
            MANIFEST: canonical(self.manifest()),
            SPEC: self.spec_text.encode(),
            PANELS: _json(panels_to_json(self.pictures), sort=False),
        }
        return dict(sorted((own | self.model_attachments() | dict(self.files)).items()))

    def model_attachments(self) -> dict[str, bytes]:
        """Return the model files to attach, each model in a folder of its own: its number in order of name."""
        return {
            f"{MODEL_FOLDER}/{nth}/{file}": content
            for nth, (_, model) in enumerate(sorted(self.models.items()))
            for file, content in model.items()
        }


def read(attachments: Mapping[str, bytes]) -> CertificateContent:
    """Return the certificate's content that wrote these attachments. Raises ContentError for others."""
    missing = [name for name in RESERVED if name not in attachments]
    if missing:
        raise ContentError(f"no {' and no '.join(missing)} is attached")
    try:
        manifest = Manifest.from_text(attachments[MANIFEST])
        if manifest.format not in (BEFORE, FORMAT):
            raise ContentError(f"{MANIFEST} has format {manifest.format!r}, this program reads up to {FORMAT}")
        models = {
            name: {file: attachments[f"{MODEL_FOLDER}/{nth}/{file}"] for file in files}
            for nth, (name, files) in enumerate(sorted(manifest.models.items()))
        }
        content = CertificateContent(
            result=within_bounds(json_of(attachments[RESULTS])),
            spec_name=manifest.spec.name,
            spec_title=manifest.spec.title,
            spec_text=attachments[SPEC].decode("utf-8"),
            operator=manifest.operator,
            instruments=manifest.instruments,
            panels=panels_from_json(json_of(attachments[PANELS])),
            files={
                name: content
                for name, content in attachments.items()
                if name not in RESERVED and not (models and name.startswith(f"{MODEL_FOLDER}/"))
            },
            inputs={name: file.sha256 for name, file in manifest.inputs.items()},
            sizes={name: file.bytes for name, file in manifest.inputs.items() if file.bytes is not None},
            models=models,
            provenance=manifest.provenance,
            format=manifest.format,
            statement=manifest.statement,
            accept_version=manifest.accept.version,
            code_sha256=manifest.accept.code_sha256,
            drawn_with=manifest.drawn_with,
        )
        _check_manifest(json_of(attachments[MANIFEST]), content)
    except (KeyError, TypeError, AttributeError, ValueError) as e:
        raise ContentError(f"the attachments do not belong together ({type(e).__name__}: {e})") from e
    return content


def within_bounds(result: dict[str, Any]) -> dict[str, Any]:
    """Return a result that can be drawn and compared; its records bound samples and gap. Raises ContentError."""
    written = {key: entry for key, entry in result.items() if key not in ("samples", "gap")}
    if problems := size_problems(written, MOST_ENTRIES, MOST_LETTERS):
        raise ContentError(f"the result is too large for a certificate: {'; '.join(problems)}")
    return result


def _check_manifest(stated: Mapping[str, Any], content: CertificateContent) -> None:
    """Compare the manifest with the one that the other attachments give, so that a script reads what was judged. A
    manifest of format 1 lacks keys; its own keys are compared. Raises ContentError naming the field."""
    derived = content.manifest()
    if content.format == BEFORE:
        derived = _keys_of(derived, stated)
    if field_named := _first_difference(stated, derived, ""):
        raise ContentError(f"{MANIFEST} does not agree with the other attachments: {field_named}")


def _keys_of(derived: Any, stated: Any) -> Any:
    if not isinstance(derived, Mapping) or not isinstance(stated, Mapping):
        return derived
    return {key: _keys_of(derived[key], stated[key]) for key in derived if key in stated}


def _first_difference(stated: Any, derived: Any, path: str) -> str | None:
    if isinstance(stated, Mapping) and isinstance(derived, Mapping):
        for key in sorted({*stated, *derived}):
            here = f"{path}.{key}" if path else str(key)
            if key not in stated or key not in derived:
                return here
            if found := _first_difference(stated[key], derived[key], here):
                return found
        return None
    return None if same_json(stated, derived) else path


def same_json(one: Any, other: Any) -> bool:
    """Return whether two values have the same canonical form, which is compared in one line: that is made ten times as
    fast."""
    return _json(one) == _json(other)


def canonical(data: Mapping[str, Any]) -> bytes:
    """Return JSON with sorted keys, one per line, UTF-8: the form of results.json inside a certificate, which is
    hashed."""
    return _json(data, indent=1)


def hashes_of(contents: CertificateContent) -> dict[str, str]:
    """Return the hashes of result and spec, as the provenance states them."""
    return {"record_sha256": contents.record_sha256, "spec_sha256": contents.spec_sha256}


def signed_text(serial: str, stated: Mapping[str, Any]) -> bytes:
    """Return the bytes that a bench signs: the serial and all that is stated but for the signature itself."""
    rest = {key: value for key, value in stated.items() if key != "signature"}
    return canonical({"serial": serial, "provenance": rest})


def _json(data: Any, *, sort: bool = True, indent: int | None = None) -> bytes:
    try:
        text = json.dumps(data, sort_keys=sort, indent=indent, ensure_ascii=False, allow_nan=False)
        return text.encode("utf-8") + b"\n"
    except ValueError as e:
        raise ContentError(f"a certificate holds no number or letter that JSON does not have: {e}") from e


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
