"""The attachments of a certificate: whether they belong together, and whether judging them again gives the same
result."""

import hashlib
import io
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pyhanko.pdf_utils.generic import ArrayObject
from pyhanko.pdf_utils.reader import PdfFileReader

from accept.base import version
from accept.base.documents.manifest import hashes
from accept.base.documents.results import UnitRecord
from accept.base.plain_text import listed
from accept.certificate.contents import content as certificate_content
from accept.certificate.contents.content import BEFORE, SIZE_LIMIT, CertificateContent, ContentError
from accept.certificate.contents.outcome import InvalidCertificate, Step
from accept.certificate.verify.picture_check import check_gap, check_pictures
from accept.certificate.verify.ports import AttachedUnit, ReadUnit
from accept.certificate.verify.result_diff import ONLY_AGAIN, differences, is_said_otherwise, is_within_U
from accept.pictures.labels import input_words
from checks.acceptance import CHECKS
from checks.picture import Panel
from hw.records import declared_samples
from specs.files import UNIT_FILE

MOST_SAMPLES = 8_000_000  # of all attached records: an actuator or strut has 5e6; small files may expand to many more


def embedded(reader: PdfFileReader) -> dict[str, bytes]:
    """Return name -> content of the files embedded in a PDF."""
    names = reader.root["/Names"]["/EmbeddedFiles"]["/Names"]
    if not isinstance(names, ArrayObject) or len(names) % 2:
        raise InvalidCertificate("the list of attachments is damaged")
    keys = [str(names[n]) for n in range(0, len(names), 2)]
    if len(set(keys)) != len(keys):
        raise InvalidCertificate("two attachments have the same name")
    return {key: names[2 * n + 1]["/EF"]["/F"].data for n, key in enumerate(keys)}


def read(signed: bytes) -> CertificateContent:
    """Return the certificate's content inside a signed PDF, its attachments verified by their hashes. Raises
    InvalidCertificate."""
    try:
        contents = certificate_content.read(embedded(PdfFileReader(io.BytesIO(signed))))
    except KeyError as e:
        raise InvalidCertificate("nothing is attached to it: it is not a certificate of this program") from e
    except ContentError as e:
        raise InvalidCertificate(str(e)) from e
    _check_hashes(contents)
    return contents


def check_result(contents: CertificateContent, unit: AttachedUnit, judged: UnitRecord | None) -> Step:
    """Compare the result with the unit as it was `judged` again from the attached data, None if it was not.

    If a record was too large to attach, only the sections whose records are attached are compared; the step is then not
    complete. For a certificate of another program the step lists the keys that it lacks, the sentences and the numbers
    that differ; of what it claims the values must be the same within U, and the limits and verdicts. Raises
    InvalidCertificate if the results differ."""
    missing = tuple(name for name in contents.inputs if name not in contents.files)
    if judged is None:
        return Step("not judged again", complete=False)
    again = judged.to_json()
    own = contents.code_sha256 == version.code_sha256()
    if not own and "samples" in again:
        again["samples"] = _sketched_as(contents.result.get("samples") or {}, again["samples"])
    left_out = _checks_of(unit, missing)
    pair = [contents.result, again]
    found = differences(*(_without_checks(result, left_out) for result in pair) if missing else pair)
    said, absent, other = list[str](), list[str](), list[str]()
    alone = {
        f"{input_words(f.check, i)} by {i.source}, but {i.against}"
        for f in judged.findings
        for i in f.inputs
        if i.against
    }
    if not own:  # its result may have fewer keys, other words, and numbers that are computed otherwise now
        absent = [line.removesuffix(ONLY_AGAIN) for line in found if line.endswith(ONLY_AGAIN)]
        said = [line for line in found if is_said_otherwise(line)]
        found = [line for line in found if line not in said and not line.endswith(ONLY_AGAIN)]
        other = [] if missing else [line for line in found if is_within_U(line, contents.result, again)]
        found = [line for line in found if line not in other]
    if found:
        raise InvalidCertificate(f"judged again from the attached data it differs: {_some(found)}{_other(contents)}")
    try:
        check_pictures(_pictures(contents.panels, left_out), _pictures(judged.panels, left_out))
    except InvalidCertificate as e:
        if own:
            raise
        said.append(str(e))  # another program may draw other pictures
    if own:
        check_gap(unit.has_responses, contents.result.get("gap"), contents.panels)
    if missing:
        what = f"{', '.join(missing)} not attached, or too long; give the unit's folder with --records"
        return Step(f"not judged again: {', '.join(sorted(left_out)) or 'a part'} ({what})", complete=False)
    if said or absent or other or (alone and not own):
        words = [f"this version computes other numbers: {_some(other)}"] if other else []
        words += [f"by this version conditional: {_some(sorted(alone))}"] if alone else []
        words += [f"said in other words: {_some(said)}"] if said else []
        words += [f"it does not state {_some(absent)}"] if absent else []
        same = f"the same values{' within U' if other else ''}, limits and verdicts"
        step = f"judged again from the attached data: {same}, {'; '.join(words)}{_other(contents)}"
        return Step(step, complete=False)
    searched = "; what its responses lack in the model was not searched for again" if "gap" in contents.result else ""
    return Step(f"judged again from the attached data: the same result{searched}{_other(contents)}")


def _sketched_as(
    attached: Mapping[str, Mapping[str, str]], again: Mapping[str, Mapping[str, str]]
) -> dict[str, dict[str, str]]:
    """Return the sketches with the parts alone that the attached ones have: earlier programs wrote fewer."""
    parts = {(name, key): text.count(":") + 1 for name, texts in attached.items() for key, text in texts.items()}
    return {
        name: {key: ":".join(text.split(":")[: parts.get((name, key))]) for key, text in texts.items()}
        for name, texts in again.items()
    }


def _some(lines: Sequence[str]) -> str:
    return listed(sorted(lines, key=lambda line: "].value " not in line), between="; ")


def _checks_of(unit: AttachedUnit, missing: Collection[str]) -> set[str]:
    reads = {section for section, files in unit.records.items() if not {*missing}.isdisjoint(files)}
    return {name for name, check in CHECKS.items() if check.reads in reads} if reads else set()


def _pictures(panels: Mapping[str, Panel], left_out: Collection[str]) -> dict[str, Panel]:
    return {name: panel for name, panel in panels.items() if name.split("/")[0] not in left_out}


def _without_checks(result: Mapping[str, Any], left_out: Collection[str]) -> dict[str, Any]:
    """Return a result without some checks. A finding without a result claims nothing and is not compared: its value may
    have been in what was left out."""
    claimed = [f for f in result["findings"] if f["check"] not in left_out]
    information = [i for i in result["information"] if i["check"] not in left_out]
    silent = {f["quantity"] for f in claimed if f["verdict"] == "no_result"}
    return {
        "serial": result["serial"],
        "kind": result["kind"],
        "findings": {f["quantity"]: f for f in claimed if f["quantity"] not in silent},
        "information": {i["quantity"]: i for i in information},
    }


def with_records(
    contents: CertificateContent, folder: Path, read_record: Callable[[Path, str], bytes]
) -> CertificateContent:
    """Return the content with the records that were too large to attach, read from a folder and verified by their
    hashes.

    Raises InvalidCertificate if a file has another content, OSError.
    """
    more = {}
    for name, digest in contents.inputs.items():
        if name not in contents.files and (folder / name).exists():
            more[name] = read_record(folder, name)
            if hashlib.sha256(more[name]).hexdigest() != digest:
                raise InvalidCertificate(f"{folder / name} is not the file that was judged")
    return replace(contents, files={**contents.files, **more})


def within_samples(contents: CertificateContent) -> CertificateContent:
    """Return the content without the longest records, as if they were too large to attach, if all declare more than
    `MOST_SAMPLES`."""
    records = {n: content for n, content in contents.files.items() if n != UNIT_FILE}
    declared = {n: declared_samples(n, content, MOST_SAMPLES) for n, content in records.items()}
    kept, total = {UNIT_FILE}, 0
    for name in sorted(declared, key=lambda name: declared[name]):
        total += declared[name]
        kept |= {name} if total <= MOST_SAMPLES else set()
    return replace(contents, files={n: content for n, content in contents.files.items() if n in kept})


def _other(contents: CertificateContent) -> str:
    if contents.code_sha256 == version.code_sha256():
        return ""
    return f" (certificate: accept {contents.accept_version}, code {contents.code_sha256[:12]}; here: another)"


def _check_hashes(contents: CertificateContent) -> None:
    if dict(contents.result.get("inputs", {})) != dict(contents.inputs):
        raise InvalidCertificate("results.json and manifest.json name different inputs")
    for name, content in contents.files.items():
        if hashlib.sha256(content).hexdigest() != contents.inputs.get(name):
            raise InvalidCertificate(f"the attached {name} is not the file that was judged")
    if hashes(contents.models) != {name: dict(files) for name, files in contents.result.get("models", {}).items()}:
        raise InvalidCertificate("the attached model files are not those that the unit was judged by")


def unit_of(contents: CertificateContent, read_unit: ReadUnit) -> AttachedUnit:
    """Return the attached unit. Raises InvalidCertificate if the inputs are not exactly those that unit.toml names, or
    if an input that is not attached is small enough to be.

    It loads the checks that the unit names, so it is called where the unit is judged: in a process of its own they
    would be loaded twice."""
    if UNIT_FILE not in contents.files:
        raise InvalidCertificate(f"{UNIT_FILE} is not attached")
    try:
        unit = read_unit(contents.files[UNIT_FILE])
    except ValueError as e:
        raise InvalidCertificate(f"the attached {UNIT_FILE} cannot be used: {e}") from e
    phantom = sorted(set(contents.inputs) - set(unit.files) - {UNIT_FILE})
    if phantom:
        raise InvalidCertificate(f"{phantom[0]} is said to have been judged, but {UNIT_FILE} names no such file")
    if unit.serial != contents.serial:
        raise InvalidCertificate(f"the attached {UNIT_FILE} is that of {unit.serial}, not of {contents.serial}")
    left = SIZE_LIMIT - sum(len(content) for name, content in contents.files.items())
    for name in contents.inputs:
        size = contents.sizes.get(name)
        if name not in contents.files and contents.format > BEFORE and (size is None or size <= left):
            raise InvalidCertificate(f"{name} of {size} bytes is not attached, although there is room for it")
    return unit
