"""`accept verify`."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.documents.listings import EvidenceFolder, SignatureVerified, VerificationDocument
from accept.base.documents.results import SIMULATED
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.loading import keep_loaded
from accept.base.plain_text import one_line
from accept.base.progress import busy, steps
from accept.base.runner import GivenUp, Processes
from accept.certificate import (
    ListsBeside,
    Validity,
    Verification,
    at_bench,
    ports,
    read_certificate,
    rejudge,
    rejudge_demo,
    trusted_lists,
    verify_certificate,
)
from accept.certificate.evidence import AUTHORITY, EVIDENCE, LIST, differences, evidence_in, is_set_aside, is_signed
from accept.certificate.trust import authority, keys
from accept.certificate.trust.revocation import beside
from accept.commands.answer import PLAIN, Answer, File, Remark, command, table
from accept.commands.options import JsonAnswer, LargeRecords
from accept.commands.trust.bench_keys import DEMO
from specs.errors import AcceptError
from specs.spec import load

REQUIREMENTS = ("accepted", "countersigned", "approved", "current")
LEAST_FOR_EACH, MOST_PROCESSES = 10, 4  # certificates that pay for the start of a process; each has 350 MB
NOT_AUTHORISED = "NOT AUTHORISED by quality assurance"
SERIAL = "serial="  # of the unit that it must be of, whatever the file is called
_EXIT = {Validity.VALID: Exit.ACCEPTED, Validity.SIGNED: Exit.INCOMPLETE, Validity.NOT_VALID: Exit.REJECTED}


class CertificatesMissing(AcceptError, ValueError):
    """A folder without certificates."""


class RequirementError(AcceptError, ValueError):
    """A requirement that cannot be asked for; the text names those that can."""


@dataclass(frozen=True)
class VerifyOptions:
    """Whom a verification trusts, and its conditions beside validity."""

    trust: Annotated[list[Path] | None, Option(help="CA certificate to trust, not this bench's.")] = None
    records: LargeRecords = None
    require: Annotated[
        str | None, Option(help="Also require: accepted,countersigned,approved,current,serial=SERIAL.")
    ] = None
    spec: Annotated[str | None, Option("--spec", help="The spec that it must have been judged by.")] = None
    demo: Annotated[bool, Option("--demo", help="A certificate of `accept demo`.")] = False
    tsa_trust: Annotated[list[Path] | None, Option(help="Root of a time stamping authority to trust.")] = None
    log: Annotated[list[Path] | None, Option("--log", help="List that benches publish; again for an earlier copy.")] = (
        None
    )


@command
def run(
    certificates: Annotated[list[Path], Argument(help="The certificate to check; several, or folders: a table.")],
    options: VerifyOptions,
    as_table: Annotated[bool, Option("--table", help="A table of one certificate too.")] = False,
    workers: Annotated[int | None, Option(min=1, help="Number of processes; default: by the amount of work.")] = None,
    json: JsonAnswer = None,
) -> Answer:
    """Verify a certificate from its own bytes. Signatures, coverage, roles, CA, and the verdict judged again."""
    required = [] if options.require is None else [word.strip() for word in options.require.split(",")]
    unknown = [word for word in required if word not in REQUIREMENTS and not word.startswith(SERIAL)]
    if unknown:  # also an empty one: a script whose variable is not set would require nothing
        choices = ", ".join((*REQUIREMENTS, f"{SERIAL}SERIAL"))
        raise RequirementError(f"--require {unknown[0] or 'nothing'}: expected one or more of {choices}")
    wanted_spec = None if options.spec is None else load(options.spec).sha256
    if as_table or len(certificates) > 1 or certificates[0].is_dir():
        package = evidence_in(certificates[0]) if len(certificates) == 1 else None
        options = options if package is None else _trusting(options, certificates[0])
        looked_at = _at_once(certificates, options, workers)
        found = [(path, report, _unmet_requirements(report, required, wanted_spec)) for path, report in looked_at]
        lines, exit = ([], Exit.ACCEPTED) if package is None else _state(certificates[0], package, options)
        return _of_many(found, json, lines, exit)
    with busy(f"{certificates[0].name}: judging again"):
        report = verifier(options)(read_certificate(certificates[0]))
    missing = _unmet_requirements(report, required, wanted_spec)
    head = "DEMO, no acceptance of a real unit: " if options.demo else ""
    tail = f" - BUT NOT AS REQUIRED: {'; '.join(missing)}" if missing else ""
    return Answer(
        *(Remark(f"  {line}") for line in report.details),
        File(json, _document(report, missing)),
        f"{head}{_outcome(report)}: {report.reason}{tail}",
        exit=_exit(report, missing),
    )


def _trusting(options: VerifyOptions, folder: Path) -> VerifyOptions:
    """Return the options with what lies in the folder of `accept evidence` where nothing else is named. A bench that
    has keys trusts its own authority."""
    own, listed = folder / AUTHORITY, folder / LIST
    return replace(
        options,
        trust=options.trust or ([own] if own.is_file() and not keys.exist(home()) else None),
        log=options.log or ([listed] if listed.is_file() else None),
        tsa_trust=options.tsa_trust or ([] if keys.exist(home()) else sorted(folder.glob("tsa*.pem"))) or None,
    )


def _trusted(options: VerifyOptions) -> list[Path]:
    return options.trust or [keys.folder(home() / DEMO if options.demo else home()) / AUTHORITY]


def _state(folder: Path, stated: EvidenceFolder, options: VerifyOptions) -> tuple[list[str], Exit]:
    """Return what is wrong with a folder of `accept evidence`, what it lacks, and whose authority it brings."""
    wrong, own, listed = list(differences(folder, stated)), folder / AUTHORITY, folder / LIST
    lacking = [f"missing since it was made: {words}" for words in stated.missing]
    if not stated.signature:
        lacking.append(f"{EVIDENCE}: no bench signed it; only the certificates and {LIST} are proven")
    else:
        roots = [keys.certificate_of(path) for path in _trusted(_trusting(options, folder))]
        lists = trusted_lists([listed], roots) if listed.is_file() else ()
        if not is_signed(stated, [one.bench for one in lists]):
            wrong.append(f"{EVIDENCE}: was changed after the bench signed it")
    lines = [*wrong, *lacking]
    if own.is_file():
        digest = authority.fingerprint(keys.certificate_of(own))
        where = "compare it with one that the laboratory gave you in another way"
        lines.append(f"authority in this folder: sha256 {digest}; {where}")
    return lines, Exit.REJECTED if wrong else Exit.INCOMPLETE if lacking else Exit.ACCEPTED


def verified(
    paths: Sequence[Path], verify: Callable[[bytes], Verification]
) -> Iterator[tuple[Path, bytes, Verification]]:
    """Yield the files among paths and every PDF in the folders among them, each once, in the order of their names in a
    folder, with its bytes and its verification. One that cannot be read is not valid: the others are looked at. Raises
    CertificatesMissing for a folder without any, before the first."""
    for nth, path in enumerate(_files(paths)):
        if nth == 1:
            keep_loaded()
        with busy(f"{path.name}: judging again"):
            found = _read_and_verified(path, verify)
        yield path, *found


def _files(paths: Sequence[Path]) -> list[Path]:
    found = dict[Path, None]()
    for path in paths:
        named = (each for each in path.rglob("*") if each.suffix.lower() == ".pdf" and not each.is_dir())
        inside = sorted(named) if path.is_dir() else [path]
        if not inside:
            raise CertificatesMissing(f"{path}: holds no certificate (no file that ends in .pdf)")
        found.update(dict.fromkeys(inside))
    return [*found]


def _read_and_verified(path: Path, verify: Callable[[bytes], Verification]) -> tuple[bytes, Verification]:
    try:
        content = read_certificate(path)
        return content, verify(content)
    except OSError as e:
        return b"", Verification(Validity.NOT_VALID, f"it cannot be read ({e.strerror or e})")


@dataclass(frozen=True)
class _Certificate:
    """A certificate to verify, as another process is told."""

    path: Path
    options: VerifyOptions

    def run(self) -> Verification:
        is_first = (key := repr(self.options)) not in _VERIFIERS
        verify = _VERIFIERS[key] = verifier(self.options) if is_first else _VERIFIERS[key]
        _, report = _read_and_verified(self.path, verify)
        if is_first:
            keep_loaded()
        return report


_VERIFIERS: dict[str, Callable[[bytes], Verification]] = {}  # of this process, by their options


def _at_once(paths: Sequence[Path], options: VerifyOptions, workers: int | None) -> list[tuple[Path, Verification]]:
    """Return the files that `verified` yields and their verifications, made on several cores if there are many. What
    no process could verify is not valid. A store that is named in the environment is asked by this process alone:
    others are not told its password."""
    files, verify = _files(paths), verifier(options)  # what is wrong with the options is said at once
    count = workers or min(os.cpu_count() or 1, MOST_PROCESSES, len(files) // LEAST_FOR_EACH)
    if count < 2 or "ACCEPT_STORE_URL" in os.environ:
        return [(path, report) for path, _, report in verified(files, verify)]
    found = dict[Path, Verification]()
    done = Processes(count).unordered(_Certificate.run, [_Certificate(path, options) for path in files])
    for job, report in steps(done, "judging again", len(files)):
        if isinstance(report, GivenUp):
            report = Verification(Validity.NOT_VALID, f"it could not be verified: {report}")
        found[job.path] = report
    return [(path, found[path]) for path in files]


def _outcome(report: Verification) -> str:
    words = {Validity.VALID: "valid", Validity.SIGNED: "SIGNED, NOT FULLY VERIFIED", Validity.NOT_VALID: "NOT VALID"}
    simulated = f"{SIMULATED}: " if report.simulated else ""
    return simulated + (f"{NOT_AUTHORISED}, " if _waits(report) else "") + words[report.outcome]


def _waits(report: Verification) -> bool:
    return report.outcome is not Validity.NOT_VALID and not report.authorised


def _exit(report: Verification, missing: Sequence[str]) -> Exit:
    return Exit.REJECTED if missing else _EXIT[report.outcome]


def _of_many(
    found: Sequence[tuple[Path, Verification, list[str]]], json: Path | None, lines: Sequence[str], exit: Exit
) -> Answer:
    """Return a row for each certificate, those that are not valid, not as required or valid with a remark with the
    reason, a count, and lines about their folder; the exit code is the worst, that of the folder included. One that was
    `set_aside` is not held against the folder."""
    exits, rows, reasons = list[Exit](), list[tuple[str, ...]](), list[str]()
    aside = set_aside([(path, report) for path, report, _ in found])
    for path, report, missing in found:
        name, by = one_line(str(path)), ", ".join(f"{by.person} ({by.role})" for by in report.signatures)
        exits.append(Exit.ACCEPTED if path in aside else _exit(report, missing))
        state = "replaced since" if path in aside else _outcome(report)
        rows.append((name, report.serial, str(report.verdict or ""), state, by))
        if exits[-1] is not Exit.ACCEPTED or report.remarks:
            reasons.append(f"{name}: {'; '.join((report.reason, *missing))}")
    documents = [{"certificate": str(path), **_document(report, missing).to_json()} for path, report, missing in found]
    required = " and as required" if any(missing for *_, missing in found) else ""
    waiting = sum(_waits(r) and _exit(r, missing) is Exit.ACCEPTED for p, r, missing in found if p not in aside)
    of_them = f", {waiting} of them {NOT_AUTHORISED}" if waiting else ""
    return Answer(
        File(json, documents),
        table(("certificate", "serial", "verdict", "is", "signed by"), rows, **PLAIN),
        *reasons,
        f"{exits.count(Exit.ACCEPTED)} of {len(found)} certificates are valid{required}{of_them}",
        *lines,
        exit=next((each for each in (Exit.REJECTED, Exit.INCOMPLETE) if each in (*exits, exit)), Exit.ACCEPTED),
    )


def set_aside(found: Sequence[tuple[Path, Verification]]) -> set[Path]:
    """Return the certificates that were set aside as replaced: a list or the store says so, not the name alone, and the
    one of that unit that stands is there too. Who renames a file must not hide that its unit was rejected since."""
    standing = {report.serial for _, report in found if report.current}
    return {p for p, report in found if is_set_aside(p) and report.current is False and report.serial in standing}


def _document(report: Verification, missing: Sequence[str]) -> VerificationDocument:
    signatures = [SignatureVerified(s.person, s.role, s.when.isoformat()) for s in report.signatures]
    return VerificationDocument(
        report.outcome.name.lower(), report.reason, tuple(missing), report.serial, str(report.verdict),
        report.spec_sha256, report.demo, report.approved, report.current, report.countersigned, tuple(signatures),
        tuple(report.details), report.simulated,
    )  # fmt: skip


def _unmet_requirements(report: Verification, require: Sequence[str], spec_sha256: str | None) -> list[str]:
    if report.outcome is Validity.NOT_VALID:
        return []
    serials = [word.removeprefix(SERIAL) for word in require if word.startswith(SERIAL)]
    unmet = (
        ("accepted", report.verdict != "accepted", f"the unit is {report.verdict}, not accepted"),
        ("accepted", report.simulated, "the unit was simulated, so no real one is accepted"),
        ("countersigned", not report.countersigned, "it is not countersigned"),
        ("approved", not report.approved, "its spec is not approved by quality assurance"),
        ("current", report.current is None, "neither a store nor a list was asked for later attempts"),
        ("current", report.current is False, "a later attempt is known"),
    )
    missing = [words for what, is_unmet, words in unmet if is_unmet and what in require]
    if any(serial != report.serial for serial in serials):
        missing.append(f"it is of {report.serial}, not of {', '.join(serials)}")
    if spec_sha256 is not None and report.spec_sha256 != spec_sha256:
        missing.append(f"it was judged by spec {report.spec_sha256[:12]}, not {spec_sha256[:12]}")
    return missing


def verifier(options: VerifyOptions) -> Callable[[bytes], Verification]:
    """Return what verifies certificates against the CAs named, else against this bench's own; against the demo's only
    if asked to. What is trusted is read once for all of them."""
    place = home() / DEMO if options.demo else home()
    if not options.trust and not keys.exist(place):
        words = f"no trusted CA: no keys found in {place}; name a CA certificate with --trust"
        return lambda _: Verification(Validity.NOT_VALID, words)
    paths = _trusted(options)
    trust = [keys.certificate_of(path) for path in paths]
    judge = rejudge_demo if options.demo else rejudge
    stamping = [keys.certificate_of(path) for path in options.tsa_trust or ()] or keys.stamping_roots(place)
    beside_trust = ListsBeside({} if options.demo else {beside(p): ca for p, ca in zip(paths, trust, strict=True)})
    lists = trusted_lists(options.log, trust) if options.log else None
    return lambda pdf: verify_certificate(
        pdf, trust, ports(judge), demo=options.demo, records=options.records, revoked=beside_trust.entries,
        known=None if options.demo else at_bench(beside_trust, lists), stamping=stamping,
    )  # fmt: skip
