"""The sentences that page and `accept verify` show beside the result, from the content of the certificate."""

import math
import tomllib
from collections.abc import Mapping
from typing import Any

from cryptography import x509
from cryptography.x509.oid import NameOID

from accept.certificate.contents.content import CertificateContent
from accept.judging.folder_name import ALIKE, CONFIRMED, NAME
from accept.models.evidence import hashes
from accept.pictures.labels import label_of
from checks.rounding import with_U
from checks.verdict import UnitVerdict

NOT_STATED = "not stated"
SIGNIFICANT = 1.0  # of both U together: the two results disagree ([ISO13528] 9.7, E_n)


def statements(contents: CertificateContent) -> dict[str, str]:
    """Return name -> sentence, in the order in which page and `accept verify` show them."""
    laboratory = contents.provenance.get("laboratory") or {}
    approved = _approval_words(contents.provenance.get("approval"))
    head = contents.provenance.get("head")
    return {
        "Laboratory": laboratory_words(laboratory),
        "Number": str(contents.provenance.get("number") or ""),
        "Customer": "" if (contents.result.get("origin") or {}).get("customer") else laboratory.get("customer", ""),
        "Methods": methods_words(laboratory.get("methods") or {}),
        "Sampling": laboratory.get("sampling", ""),
        "Spec": f"{contents.spec_name}, sha256 {contents.spec_sha256}{approved}",
        "Models": _models(contents),
        "Attempt": _attempt(contents.provenance),
        "Amended": _amended(contents.provenance),
        "Signed": _signed(contents),
        "Changed": changes_words(contents),
        "Calibration": _calibration(contents.result.get("calibration")),
        "Folder": _folder(contents.result.get("folder") or {}),
        "Copies": "; ".join(map(_one_copy, contents.result.get("copies") or [])),
        "Store": NOT_STATED if head is None else f"event {head['seq']}, {head['hash']}",
        "Bench": _bench(contents.provenance),
    }


def laboratory_words(stated: Mapping[str, str]) -> str:
    """Return name, address, place of measuring and accreditation in one line ([ISO17025] 7.8.2.1 b, c)."""
    site = f"measured at {stated['site']}" if "site" in stated else ""
    parts = (stated.get("name", ""), stated.get("address", ""), site, stated.get("accreditation", ""))
    return "; ".join(part for part in parts if part)


def methods_words(methods: Mapping[str, str]) -> str:
    """Return the methods with the checks that are measured by each ([ISO17025] 7.8.2.1 f)."""
    by: dict[str, list[str]] = {}
    for check, method in sorted(methods.items()):  # an attachment has them in this order
        by.setdefault(method, []).append(check)
    return "; ".join(f"{method} ({', '.join(checks)})" for method, checks in by.items())


def changes_words(contents: CertificateContent) -> str:
    """Return which quantities differ from the judgement that is replaced by more than both uncertainties explain."""
    before, out = contents.provenance.get("before") or {}, []
    for finding in contents.result["findings"]:
        was = before.get(finding["quantity"])
        if was is None or finding["value"] is None or finding["U"] is None:
            continue
        U = math.hypot(was["U"], finding["U"])
        change = finding["value"] - was["value"]
        if abs(change) > SIGNIFICANT * U:
            unit = "" if finding["unit"] == "1" else f" {finding['unit']}"
            now, then = with_U(finding["value"], finding["U"]), with_U(was["value"], was["U"])
            out.append(f"{label_of(finding['quantity'])} from {then} to {now}{unit}, more than both U explain")
    return "; ".join(out)


def _approval_words(approval: Mapping[str, Any] | None) -> str:
    if approval is None:
        return ""
    if approval.get("builtin"):
        return "; comes with the program"
    if approval.get("person"):
        return f"; approved by {approval['person']} on {str(approval.get('time', ''))[:10]}"
    return f"; NOT APPROVED{': ' + str(approval['reason']) if approval.get('reason') else ''}"


def _models(contents: CertificateContent) -> str:
    named = [f"{n} ({f} {digest[:12]})" for n, files in hashes(contents.models).items() for f, digest in files.items()]
    learned = (_learned_bench(name, content) for files in contents.models.values() for name, content in files.items())
    return "; ".join([*named, *(words for words in learned if words)])


def _learned_bench(name: str, content: bytes) -> str:
    """Return which units an attached model file learned its bench effects from, and when; "" if it did not."""
    if not name.endswith(".toml"):
        return ""
    try:
        bench = tomllib.loads(content.decode()).get("learned_bench")
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        return ""
    if not isinstance(bench, Mapping):
        return ""
    units = [str(serial) for serial in bench.get("units", [])]
    day = f" on {bench['learned_on']}" if bench.get("learned_on") else ""
    return f"compared on a bench learned{day} from {len(units)} units: {', '.join(units)}"


def _attempt(provenance: Mapping[str, Any]) -> str:
    number, before = provenance.get("attempt"), provenance.get("replaces")
    if number is None:
        return NOT_STATED
    reason = None if provenance.get("amends") else provenance.get("reason")  # then it stands there
    why = "" if reason is None else f"; reason: {reason}" if reason else "; no reason was given"
    judged = f", judged on {str(provenance['judged'])[:10]}" if provenance.get("judged") else ""
    earlier = _earlier(provenance)
    if before is None:
        return f"{number}{judged}{earlier}{why}"
    certificate = f", certificate sha256 {str(before['certificate'])[:12]}" if before.get("certificate") else ""
    if before.get("earlier_certificate"):
        digest, earlier = str(before["earlier_certificate"])[:12], before.get("earlier_attempt")
        certificate = f", which had no certificate, and certificate sha256 {digest} of attempt {earlier}"
    when = str(before["time"])[:19].replace("T", " ")
    replaced = f"replaces '{before['verdict']}' of {when} UTC{certificate}"
    return f"{number}{judged}, {replaced}{earlier}{why}"


def _earlier(provenance: Mapping[str, Any]) -> str:
    """Return how many attempts before ended with which verdict, and which was the last that was not accepted."""
    if (given := provenance.get("earlier")) is None:
        return "; how the attempts before ended is not stated" if provenance.get("replaces") else ""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in sorted(given["verdicts"].items()))
    if (last := given["not_accepted"]) is None:
        return f"; before: {counts}"
    stopped = f"attempt {last['attempt']}, {last['verdict']} on {str(last['time'])[:10]}"
    return f"; before: {counts}; last not accepted: {stopped}"


def _amended(provenance: Mapping[str, Any]) -> str:
    """Return which certificate with another result this one replaces, and why ([ISO17025] 7.8.8.3)."""
    why = provenance.get("reason") or provenance.get("signed_because") or "no reason was given"
    return f"replaces certificate {provenance['amends']}: {why}" if provenance.get("amends") else ""


def _signed(contents: CertificateContent) -> str:
    """Return why the technician signed a unit that is not accepted, "" if no reason is stated."""
    reason, verdict = contents.provenance.get("signed_because"), contents.result["verdict"]
    return f"by {contents.operator} although {verdict}: {reason}" if reason and verdict != UnitVerdict.ACCEPTED else ""


def _calibration(given: Mapping[str, Any] | None) -> str:
    if given is None:
        return NOT_STATED
    wrong = [row["problem"] for row in given["instruments"] if row.get("problem")]
    state = f"{len(wrong)} not valid" if wrong else "all valid"
    return f"bench file {given['bench']} of {given['on']}: {len(given['instruments'])} instruments, {state}"


def _folder(given: Mapping[str, str]) -> str:
    if not given:
        return ""
    confirmation = (
        f"the serial was confirmed by {given[CONFIRMED]}" if CONFIRMED in given else "the serial was not confirmed"
    )
    named = [f"called {given[NAME]}, which is another serial; {confirmation}"] if NAME in given else []
    alike = [f"the serial looks like {given[ALIKE]}, and was not confirmed"] if ALIKE in given else []
    return "; ".join(named + alike)


def _one_copy(copy: Mapping[str, Any]) -> str:
    others = ", ".join(f"{w['serial']} {w['sample']}" for w in copy["with"])
    same = f"{copy['sample']} holds the samples of {others}"
    decision = copy.get("resolved")
    if decision is None:
        return f"{same}: without a result until quality assurance decides where it belongs"
    whose = ", ".join(f"{serial} {sample}" for serial, sample in decision["measured"])
    day = str(decision["time"])[:10]
    return f"{same}: measured at {whose}, decided by {decision['who']} on {day}: {decision['reason']}"


def _bench(provenance: Mapping[str, Any]) -> str:
    """Return the name in the bench's certificate, and that the authority's key lies there if it does."""
    if "bench" not in provenance:
        return "" if "demo" in provenance else "without a certificate of the authority"
    certificate = x509.load_pem_x509_certificate(str(provenance["bench"]).encode("ascii"))
    name = str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)
    return f"{name}; the authority's key lies at this bench" if "authority" in provenance else name
