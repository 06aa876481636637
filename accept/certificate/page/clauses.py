"""The rows and sentences of a certificate's pages: the statements of a laboratory's report beside its results
([ISO17025] 7.8.2, 7.8.3 and 7.8.6), as far as they are known."""

import re
from collections.abc import Mapping
from typing import Any

from accept import units
from accept.base.names import shown_name
from accept.certificate.contents.content import CertificateContent
from accept.certificate.contents.statements import statements
from accept.judging import section_read_by
from accept.pictures.labels import check_label, input_words, stated_inputs
from accept.store.decisions import stated_words
from checks.verdict import RULES
from specs.files import UNIT_FILE
from specs.strict import toml_of

COVERAGE = "U is the expanded uncertainty with k = 2, a coverage of about 95 % for a normal distribution."
SCOPE = "The results relate only to the item tested. This certificate may be copied as a whole only."
COMPARED = ("Store", "Bench")  # statements that a program compares and no reader needs
CUSTOMER = "customer"  # in [provided] of unit.toml
_HASH = re.compile(r"(?<=sha256 )([0-9a-f]{12})[0-9a-f]{52}")
_ENVIRONMENT = {"temperature_C": ("temperature", "°C"), "humidity_percent": ("relative humidity", "%")}


def identity_rows(contents: CertificateContent) -> list[tuple[str, str]]:
    """Return the rows below the verdict, name and words. Hashes are shortened: whole ones come last."""
    parts = contents.result.get("parts") or {}
    return [
        *(("Decided", decided) for decided in stated_words(contents.result.get("dispositions", ()))),
        *((row, _HASH.sub(r"\1", text)) for row, text in statements(contents).items() if row not in COMPARED),
        ("Operator", operator_words(contents)),
        ("Instruments", instruments_words(contents) or "none named by the spec"),
        ("Parts", _pairs_text(parts)),
        ("Item", item_words(contents.result)),
        ("Measured", days_words(contents.result)),
        ("Environment", environment_words(contents.result)),
        ("Entered", entered_words(contents)),
        ("Provided", provided_words(contents.result)),
    ]


def compared_rows(contents: CertificateContent) -> list[tuple[str, str]]:
    """Return the rows that a program compares and no reader needs."""
    attached = sum(name in contents.files for name in contents.inputs)
    return [
        ("Spec", f"sha256 {contents.spec_sha256}"),
        *((row, text) for row, text in statements(contents).items() if row in COMPARED),
        ("Record", f"{attached} of {len(contents.inputs)} input files attached; the hash of each in manifest.json"),
    ]


def operator_words(contents: CertificateContent) -> str:
    """Return who signs and, if others measured the unit, who they are: of several, the notes name them by step."""
    signs = contents.operator or "not named"
    by_check = units.by_check(contents.unit_file, "measured_by", [])
    people = list(dict.fromkeys(name for names in by_check.values() for name in names))
    if {name.casefold() for name in people} <= {signs.casefold()}:
        return signs
    shown = ", ".join(shown_name(name, typed=name.casefold() != signs.casefold()) for name in people)
    return f"{signs} (signs); measured by {shown}{': see Notes' if len(people) > 1 else ''}"


def days_words(result: Mapping[str, Any]) -> str:
    """Return the days of measuring, "" if none is stated (7.8.2.1 i)."""
    days = sorted(set((result.get("measured") or {}).values()))
    if not days:
        return ""
    span = days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"
    missing = {f["check"] for f in result["findings"] if f["value"] is not None} - set(result["measured"])
    return f"{span}; no day is stated for {', '.join(map(check_label, sorted(missing)))}" if missing else span


def item_words(result: Mapping[str, Any]) -> str:
    """Return the stated origin, condition and customer of the item, "" if none is stated (7.8.2.1 e, g, h)."""
    stated = sorted((result.get("origin") or {}).items())  # an attachment has them in this order
    return ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in stated)


def entered_words(contents: CertificateContent) -> str:
    """Return the checks whose values have no recording, those entered and those read from an instrument apart, and the
    numbers that were entered beside recordings; "" without any of these (7.8.2.2)."""
    sections = contents.unit_file
    entered: dict[str, str] = {}
    read: dict[str, str] = {}
    read_with = units.by_check(sections, "read_with", [])
    for check in dict.fromkeys(f["check"] for f in contents.result["findings"] if f["value"] is not None):
        section = sections.get(section_read_by(check), {})
        texts = [text for value in section.values() for text in (value if isinstance(value, list) else [value])]
        if section and not any(text in contents.inputs for text in texts if isinstance(text, str)):
            sources = read_with.get(section_read_by(check))
            if sources is None:
                entered[check] = check_label(check)
            else:
                read[check] = f"{check_label(check)} ({', '.join(sources)})"
    told = [f"values of {', '.join(entered.values())} were entered without a recording"] if entered else []
    if read:
        told.append(f"values of {', '.join(read.values())} were read from the instrument named, without a recording")
    beside = [
        f"{input_words(check, one)} ({check_label(check)})"
        for check, inputs in stated_inputs(contents.result).items()
        for one in inputs
        if one.source == UNIT_FILE and isinstance(one.value, int | float) and check not in (*entered, *read)
    ]
    told += [f"numbers entered beside recordings: {', '.join(beside)}"] if beside else []
    return "; ".join(told)


def provided_words(result: Mapping[str, Any]) -> str:
    """Return which values the customer or an external provider provided, "" if none are (7.8.2.1 p, 7.8.2.2)."""
    by: dict[str, list[str]] = {}
    for check, who in sorted((result.get("provided") or {}).items()):
        by.setdefault(who, []).append(check_label(check))
    parts = [
        f"{', '.join(checks)} by the customer, who answers for what it provided"
        if who == CUSTOMER
        else f"{', '.join(checks)} by {who}, an external provider"
        for who, checks in by.items()
    ]
    return "; ".join(parts)


def environment_words(result: Mapping[str, Any]) -> str:
    """Return the stated properties of the air, "" if none is stated (7.8.3.1 a)."""
    words = []
    for name, (label, unit) in _ENVIRONMENT.items():
        if stated := (result.get("environment") or {}).get(name):
            U = "" if stated["U"] is None else f" ± {stated['U']:g}"
            words.append(f"{label} {stated['value']:g}{U} {unit}")
    return ", ".join(words)


def limit_sources(contents: CertificateContent) -> dict[tuple[str, str], str]:
    """Return check and quantity -> the source of its limit by the attached spec: which requirement a statement of
    conformity is about (7.8.6.2 b)."""
    checks = toml_of(contents.spec_text.encode()).get("checks", {})
    limits = ((check, *each) for check, section in checks.items() for each in section.get("limits", {}).items())
    return {(check, quantity): str(limit.get("source", "")) for check, quantity, limit in limits}


def rule_words(result: Mapping[str, Any]) -> str:
    """Return the decision rules of the findings in words, coverage and scope (7.8.6.1, 7.8.2.1 l)."""
    used = dict.fromkeys(finding["rule"] for finding in result["findings"])
    decision = "".join(f"Decision rule {r}: a finding passes if {RULES[r]}. " for r in RULES if r in used)
    return f"{decision}{COVERAGE} {SCOPE}"


def instruments_words(contents: CertificateContent) -> str:
    """Return the instruments as the bench file states them; of checks without an entry there, those of the spec."""
    used: dict[str, str] = {}
    for row in (contents.result.get("calibration") or {}).get("instruments", ()):
        who = " ".join(str(word) for word in (row["model"], row["serial"]) if word) or str(row["name"])
        used[row["check"]] = f"{used[row['check']]}, {who}" if row["check"] in used else who
    by_spec = " (named by the spec)" if used else ""
    named = {check: f"{words}{by_spec}" for check, words in contents.instruments.items()} | used
    return _pairs_text({check_label(check): words for check, words in named.items()})


def _pairs_text(entries: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {text}" for name, text in sorted(entries.items()))
