"""A realistic unit (APA 3 of [STB]) for the tests of certificates."""

import hashlib
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from accept.base.documents.results import Information, UnitRecord
from accept.certificate import CertificateContent, content_of
from accept.certificate.contents.content import hashes_of, signed_text
from accept.certificate.trust import authority
from accept.judging.advice import action
from accept.store import SignedHead, StoreHead
from accept.store.payloads import CertificateSigned
from checks.picture import Band, Heights, Line, Mark, Panel
from checks.quantity import Contribution, Quantity
from checks.verdict import Finding, judge, unit_verdict
from specs.spec import Limit, Spec, parse

BENCH_KEY = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
WHEN = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
SPEC_TEXT = """
name = "basic"
kind = "apa"
title = "APA300ML, basic measurements"
[checks.capacitance]
instrument = "LCR-819, 1 kHz"
[checks.capacitance.limits.sensor_uF]
lower = 4.4
upper = 5.5
unit = "uF"
rule = "guarded"
source = "[STB] 2.2"
[checks.stroke]
instrument = "Millimar 1240"
[checks.stroke.limits.stroke_um]
lower = 304.0
unit = "um"
rule = "simple"
source = "[STB] 2.3"
"""
UNIT_TOML = (
    b'serial = "APA-03"\nkind = "apa"\n[capacitance]\nsensor_uF = 1.72\n[stroke]\none_stack = "raw/stroke.mat"\n'
)
RECORD = bytes(range(256)) * 20


def spec() -> Spec:
    return parse(SPEC_TEXT.encode(), "basic.toml")


def finding(name: str, value: float, U: float, limit: Limit, check: str = "capacitance") -> Finding:
    return judge(check, Quantity.of(name, value, Contribution("stated", U / 2)), limit)


def panels() -> dict[str, Panel]:
    x, y = np.array([-29.5, -16.0, 16.0, 29.5] * 2), np.repeat([9.0, -9.0], 4)
    z = np.array([1.07, -2.07, 2.07, 0.43, 2.07, -2.07, -1.57, 2.07])
    phase = np.linspace(0, 4 * np.pi, 5001)
    volt, stroke = 65 - 85 * np.cos(phase), 90 - 90 * np.cos(phase) + 6 * np.sin(phase)
    flat = Heights(x, y, z, "height above the plane [um]")
    zone = Band(np.array([0.5, 8.5]), np.full(2, -2.07), np.full(2, 2.07), "zone")
    loop = (Line(volt, stroke, "three stacks"), Mark(304.0, "y", "limit 304 um"))
    return {
        "flatness/heights": Panel("Heights", "x [mm]", "y [mm]", (flat,), equal=True),
        "flatness/zone": Panel("Zone", "point", "height [um]", (zone, Line(np.arange(1.0, 9.0), z, style="points"))),
        "stroke/loops": Panel("Loops", "voltage [V]", "displacement [um]", loop),
    }


def result(sensor_uF: float = 1.72, stroke_um: float = 181.7, serial: str = "APA-03") -> UnitRecord:
    limits = {name: limit for check in spec().checks.values() for name, limit in check.limits.items()}
    found = (
        finding("sensor_uF", sensor_uF, 0.0086, limits["sensor_uF"]),
        finding("stroke_um", stroke_um, 1.8, limits["stroke_um"], "stroke"),
    )
    return UnitRecord(
        serial=serial,
        kind="apa",
        verdict=unit_verdict(found),
        findings=found,
        information=(
            Information.of("flatness", Quantity.of("interface_tilt_urad", 231.2, Contribution("probe", 22.0))),
        ),
        not_judged=("frf (low.mat, high.mat)",),
        notes=("stroke: one stack 60.1 um, two stacks 121.6 um",),
        inputs={n: hashlib.sha256(c).hexdigest() for n, c in (("unit.toml", UNIT_TOML), ("raw/stroke.mat", RECORD))},
        action=action(found),
        spec=f"basic@{spec().sha256}",
        panels=panels(),
    )


judged_again = result  # what who judges it again finds, with other values instead


def folder(path: Path) -> Path:
    (path / "raw").mkdir(parents=True, exist_ok=True)
    (path / "unit.toml").write_bytes(UNIT_TOML)
    (path / "raw/stroke.mat").write_bytes(RECORD)
    return path


def stated_head(seq: int = 7, key: Ed25519PrivateKey = BENCH_KEY) -> dict[str, Any]:
    """Head of a store that a test's bench signed."""
    head = StoreHead(seq, "ab" * 32)
    bench = key.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw).hex()
    return SignedHead(head, bench, key.sign(f"accept store head {head}".encode()).hex()).to_json()


ROOT_KEYS: dict[bytes, ec.EllipticCurvePrivateKey] = {}  # of the authorities of tests, by their fingerprint


def stated(ca: x509.Certificate | None = None, serial: str = "APA-03", **more: Any) -> dict[str, Any]:
    """Provenance of a first attempt by a spec that quality assurance has not approved, signed by a bench of an
    authority if one is given."""
    reason = {"reason": "quality assurance has not signed it"}
    given = {"attempt": 1, "replaces": None, "approval": reason, "head": stated_head()} | more
    if ca is None:
        return given
    root_key = ROOT_KEYS[ca.fingerprint(SHA256())]
    own = authority.leaf("bench", "bench 1", BENCH_KEY.public_key(), ca, root_key, WHEN)
    given["bench"] = own.public_bytes(Encoding.PEM).decode()
    return given | {"signature": BENCH_KEY.sign(signed_text(serial, given)).hex()}


def certificate_contents(
    path: Path, unit: UnitRecord | None = None, ca: x509.Certificate | None = None, **more: Any
) -> CertificateContent:
    given: dict[str, Any] = {"provenance": stated(ca)} | more
    contents = content_of(unit or result(), spec(), folder(path), "M. Keller", **given)
    return contents if "provenance" in more else bench_signed(contents)


def bench_signed(contents: CertificateContent, key: Ed25519PrivateKey = BENCH_KEY) -> CertificateContent:
    """With the signature of the bench over what it states now, if it states a bench."""
    if "bench" not in contents.provenance:
        return contents
    given = {**contents.provenance, "result": hashes_of(contents)}
    return replace(contents, provenance=given | {"signature": key.sign(signed_text(contents.serial, given)).hex()})


def signed_event(path: Path, pdf: bytes) -> CertificateSigned:
    """The event of a technician's signature, as a program that asks nothing would store it."""
    return CertificateSigned(str(path.resolve()), hashlib.sha256(pdf).hexdigest(), authority.TECHNICIAN)
