"""The statements of a certificate that nothing confirms here."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from accept.base.version import code_sha256
from accept.certificate.contents.content import MANIFEST, RESULTS, CertificateContent
from accept.certificate.contents.outcome import Step
from accept.certificate.contents.provenance import Way
from accept.certificate.contents.statements import STATEMENTS, statement_of
from accept.certificate.verify.picture_check import own_words
from accept.certificate.verify.ports import AttachedUnit
from checks.verdict import UnitVerdict

LOOKED_UP = tuple(s.field for s in STATEMENTS if Way.LOOKED_UP in s.ways)
OF_THE_RESULT = tuple(s.field for s in STATEMENTS if Way.LOOKED_UP in s.ways and s.document == RESULTS)


def taken_on_trust(contents: CertificateContent, looked_up: Collection[str]) -> Step:
    """Name the fields that are stated and that only a store or a list shows, or nothing at all, without those that were
    looked up: they are the word of bench and technician, who signed them. The first line names an attempt before that
    was not accepted, also where a store was asked: quality assurance signs no judgement."""
    stated = {*_fields(contents.manifest()), *(key for key, value in contents.result.items() if value)}
    stated |= set(contents.unit_file)
    rows = (s for s in STATEMENTS if {Way.LOOKED_UP, Way.STATED} & {*s.ways} and s.field != "operator")
    trusted = [s.field for s in rows if s.field in stated and s.field not in looked_up]
    words = f"not looked up, the word of bench and technician: {', '.join(trusted)}" if trusted else ""
    last = contents.stated.earlier.not_accepted if contents.stated.earlier else None
    if last is None or contents.result["verdict"] != UnitVerdict.ACCEPTED:
        return Step(words)
    return Step(words, remark=last.words)


def words_on_trust(contents: CertificateContent, unit: AttachedUnit, looked_up: Collection[str]) -> Step:
    """Check the sentences of the result that this program writes and that do not follow from the attachments: not
    complete if neither a store nor a list has them, for they could say anything."""
    if contents.code_sha256 != code_sha256():
        return Step("")  # it is never plainly valid
    result = contents.result
    found = [field for field in own_words(contents) if "gap" not in looked_up]
    found += [field for field in ("part_doubts", "rereadings") if result.get(field) and field not in looked_up]
    if set(result.get("superseded", {}).values()) - set(result.get("nonconformances", ())):
        found.append("superseded")  # what an earlier attempt holds against a finding holds the unit: no store has this
    if any(given.get("certificate") for given in result.get("dispositions", ())) and "dispositions" not in looked_up:
        found.append("dispositions")  # signed about a certificate: what that stated does not follow
    if set(result.get("nonconformances", ())) - {*unit.nonconformances} and "nonconformances" not in looked_up:
        found.append("nonconformances")
    words = "neither the store of its bench nor a list was asked for the words of"
    return Step(f"{words} {', '.join(f'{RESULTS} {field}' for field in found)}", complete=False) if found else Step("")


def unlisted(contents: CertificateContent) -> list[str]:
    """Return the fields of manifest and result that no statement declares."""
    documents = {MANIFEST: contents.manifest(), RESULTS: contents.result}
    return [
        f"{document}: {path}"
        for document, content in documents.items()
        for path in _fields(content)
        if statement_of(document, path) is None
    ]


def _fields(content: Mapping[str, Any]) -> Iterator[str]:
    for key, value in content.items():
        if key == "provenance" and isinstance(value, Mapping):
            yield from (f"{key}.{name}" for name in value)
        else:
            yield str(key)
