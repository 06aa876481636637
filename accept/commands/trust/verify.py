"""`accept verify`."""

from pathlib import Path

from cryptography import x509

from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate import keys
from accept.certificate.attachments import Rejudge
from accept.commands.trust.bench_keys import DEMO
from accept.verify.rejudge import rejudge, rejudge_demo
from accept.verify.verification import Verification, verify


@clear_errors
def run(path: Path, trust: list[Path]) -> Exit:
    """One line on stdout, valid or not and why; what was looked at on stderr."""
    report = verify_here(path.read_bytes(), trust)
    for line in report.details:
        say(f"  {line}")
    stdout.print(f"{'valid' if report.valid else 'NOT VALID'}: {report.reason}", soft_wrap=True)
    return Exit.ACCEPTED if report.valid else Exit.REJECTED


def verify_here(pdf: bytes, trust: list[Path]) -> Verification:
    """Verification against the CAs named, else against this bench's own, else against that of the demo."""
    if trust:
        return verify(pdf, [keys.certificate_of(path) for path in trust], rejudge)
    known: list[tuple[x509.Certificate, Rejudge]] = []
    if keys.exist(home()):
        known.append((keys.ca(home()), rejudge))
    if keys.exist(home() / DEMO):
        known.append((keys.ca(home() / DEMO), rejudge_demo))
    if not known:
        return Verification(False, f"no trusted CA: no keys found in {home()}; name a CA certificate with --trust")
    reports = [verify(pdf, [ca], judge) for ca, judge in known]
    return next((r for r in reports if r.valid), reports[0])
