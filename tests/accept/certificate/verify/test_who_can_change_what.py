"""The table of who can change what, in docs/explanation/what-a-certificate-proves.md: every statement is changed by
everybody who has one more key, and what `accept verify` says is what the table says."""

import hashlib
import io
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter

from accept.base.home import home
from accept.certificate import CertificateContent, ContentError, Validity, Verification
from accept.certificate.contents import content as C
from accept.certificate.contents.content import MANIFEST, PANELS, RESULTS, SPEC, hashes_of, signed_text
from accept.certificate.contents.statements import PAGE, STATEMENTS
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.verify.against_store import check_store
from accept.store import StoreHead
from accept.store.seal import _said, own_key
from accept.units.unit_folder import UNIT_FILE
from tests.accept.certificate.verify.test_forged_provenance import (
    PHRASE,
    checked,
    contents,
    named,
    other,
    told,
    twice_certified,
)
from tests.accept.certificate.verify.test_statements import page_with
from tests.soak import SOAK

__all__ = ["contents", "twice_certified"]
BEFORE_SIGNING = ("as typed", "first line", "store", "named", "program")
EVERY = 1 if SOAK else 6

STATED: dict[str, Any] = {  # what a forger states where the unit's own certificate states nothing
    "information": [
        {"check": "stroke", "quantity": "stroke_drift_percent", "value": 0.1, "U": 0.01, "unit": "percent"}
    ],
    "not_judged": ["hysteresis (raw.csv)"],
    "notes": ["stroke: accepted after review"],
    "parts": {"sensor": "S-7"},
    "models": {"m": {"m.toml": "0" * 64}},
    "calibration": {"bench": "lab bench 7", "sha256": "ab" * 32, "on": "2026-11-23", "instruments": []},
    "copies": [{"sample": "stroke/typed", "with": [{"serial": "A-1", "sample": "stroke/typed"}], "withheld": False}],
    "measured": {"stroke": "2026-01-01"},
    "origin": {"customer": "Observatory"},
    "environment": {"temperature_C": {"value": 21.0, "U": 0.5}},
    "provided": {"stroke": "customer"},
    "simulated": True,
    "nonconformances": ["stroke: a crack (Ann)"],
    "folder": {"name": "A-1", "confirmed_by": "Test Technician"},
    "part_doubts": ["sensor: S-7 was rejected"],
    "action": "clean the anvil and measure again",
    "gap": {"verdict": "explained", "named": []},
    "samples": {"stroke/typed": {"values": "0" * 64}},
    "verdict": "rejected",
    "kind": "strut",
}


def changed(value: Any) -> Any:
    """Return another value of the same kind."""
    if isinstance(value, dict) and value:
        key = next((k for k in sorted(value) if type(value[k]) in (int, float)), sorted(value)[-1])
        return value | {key: changed(value[key])}
    if isinstance(value, list) and value:
        return [changed(value[0]), *value[1:]]
    return other(value) if not isinstance(value, dict | list) else "x"


def forged(whole: CertificateContent, where: str, field: str, bench: bool) -> bytes:
    """Page and attachments with one statement changed. bench: what the bench's key signs is signed again."""
    new, attached = whole, dict[str, bytes]()
    name = field.removeprefix("provenance.")
    if name != field:
        given = {**whole.provenance, name: _provenance(name, whole.provenance.get(name), bench)}
        new = replace(whole, provenance={k: v for k, v in given.items() if v is not None})
    elif where == RESULTS:
        new = replace(whole, result={**whole.result, field: STATED.get(field, changed(whole.result.get(field)))})
    elif where == SPEC:
        new = replace(whole, spec_text=whole.spec_text.replace("304", "150"))
    elif where == PANELS:
        key = sorted(whole.panels)[0]
        new = replace(whole, panels={**whole.panels, key: replace(whole.panels[key], title="as drawn")})
    elif where == UNIT_FILE:
        text = whole.files[UNIT_FILE].replace(b"[flatness]", b'["%s"]\nstroke = ["Ann"]\n[flatness]' % field.encode())
        inputs = {**whole.inputs, UNIT_FILE: hashlib.sha256(text).hexdigest()}
        files, sizes = {**whole.files, UNIT_FILE: text}, {**whole.sizes, UNIT_FILE: len(text)}
        new = replace(whole, files=files, inputs=inputs, sizes=sizes, result={**whole.result, "inputs": inputs})
    elif field == "operator":
        new = replace(whole, operator="Ann")
    elif where == MANIFEST:
        manifest = whole.manifest()
        attached = {MANIFEST: C.canonical({**manifest, field: changed(manifest.get(field))})}
    if bench and field != "provenance.signature":
        given = {**new.provenance} | ({} if field == "provenance.result" else {"result": hashes_of(new)})
        signature = own_key(home() / "bench.key").sign(signed_text(new.serial, given)).hex()
        new = replace(new, provenance=given | {"signature": signature})
    if where == PAGE:
        return page_with(render(replace(new, operator="Ann")), new.attachments())
    attached = {**new.attachments(), **attached}
    try:
        return render(C.read(attached))
    except (ContentError, KeyError, TypeError, ValueError, AttributeError):
        return page_with(render(whole), attached)


def _provenance(name: str, value: Any, bench: bool) -> Any:
    """Return another value of a statement of the provenance, None to leave it out."""
    if name in ("authority", "crl", "bench"):
        return None
    if name == "replaces":
        return value | {"verdict": "incomplete"}  # any other word is refused
    if name == "head" and bench:
        head = StoreHead(value["seq"], "ab" * 32)
        return value | {"hash": head.hash, "signature": own_key(home() / "bench.key").sign(_said(head)).hex()}
    return True if name == "demo" else changed(value) if value is not None else "x"


def edited(pdf: bytes, where: str, content: bytes) -> bytes:
    """The signed file with one attachment replaced by a further revision, as any editor saves it."""
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    names = list(writer.root["/Names"]["/EmbeddedFiles"]["/Names"])
    there = {str(name): of.get_object() for name, of in zip(names[::2], names[1::2], strict=True)}
    stream = there[where]["/EF"].raw_get("/F").get_object() if where in there else writer.root["/Pages"]
    if where in there:
        stream.strip_filters()
        stream._data = content
    else:
        stream["/Remark"] = generic.pdf_string("x")
    writer.update_container(stream)
    writer.write_in_place()
    return bytes(writer.prev.stream.getvalue())


def said(report: Verification, field: str) -> str:
    """Return the mark of the table for what a verification says."""
    if report.outcome is not Validity.VALID:
        return "3" if report.outcome is Validity.NOT_VALID else "4"
    return "named" if field in named(report) else "nothing"


def rows() -> dict[tuple[str, str], list[str]]:
    """Return where and statement -> the other cells of the table, as the page has it."""
    page = (Path(__file__).parents[4] / "docs/explanation/what-a-certificate-proves.md").read_text("utf-8")
    table = page.split("## Who can change what")[1].split("\n## ")[0]
    lines = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| ")]
    found = ([cell.strip() for cell in line] for line in lines[1:])
    return {(where, field.replace("all of it", "")): cells for where, field, *cells in found}


def test_every_statement_has_its_row() -> None:
    assert [*rows()] == [(s.document, s.field) for s in STATEMENTS]
    for key, (before, *after) in rows().items():
        assert before in BEFORE_SIGNING, key
        assert all(re.fullmatch(r"([34]|named|nothing)( / ([34]|named|nothing))?|=", cell) for cell in after), key


@pytest.mark.slow
def test_what_shows_is_what_the_table_says(contents: CertificateContent) -> None:
    technician = keys.unlock(home(), keys.TECHNICIAN, PHRASE, "Test Technician")
    qa = replace(keys.unlock(home(), keys.QA, "battery staple"), role=keys.TECHNICIAN)
    now = datetime.now(UTC)
    signed = sign(render(contents), technician, now)
    told(contents, signed)
    assert checked(signed, check_store).valid
    wrong = []
    for (where, field), (_, by_editor, by_technician, with_bench, by_qa) in list(rows().items())[::EVERY]:
        found = {"editor": (by_editor, [checked(edited(signed, where, b"{}"))])}
        pages = {"technician": by_technician} | ({"bench": with_bench} if with_bench != "=" else {})
        for who, expected in pages.items():
            pdf = sign(page := forged(contents, where, field, who == "bench"), technician, now)
            told(contents, pdf)
            found[who] = (expected, [checked(pdf, check_store), checked(pdf)])
        found["qa"] = (by_qa, [checked(sign(page, qa, now))])
        for who, (expected, reports) in found.items():
            marks = " / ".join(dict.fromkeys(said(report, field) for report in reports))
            if marks != expected:
                wrong.append(f"{where} {field}, {who}: {marks}, not {expected}: {reports[0].reason[:90]}")
    assert wrong == []


def test_the_size_of_an_attached_file_is_its_own(contents: CertificateContent) -> None:
    """Sizes decide what there was no room for."""
    manifest = contents.manifest()
    manifest["inputs"][UNIT_FILE]["bytes"] += 1
    with pytest.raises(ContentError, match=r"inputs\.unit\.toml\.bytes"):
        C.read({**contents.attachments(), MANIFEST: C.canonical(manifest)})
