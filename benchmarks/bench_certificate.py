"""How long certificates take: seven of them, rendered, signed twice and verified, as ratios to a plain PDF page."""

import io
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from reportlab.pdfgen.canvas import Canvas

from accept.certificate import ports, verify_certificate
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.trust.keys import QA, TECHNICIAN
from tests.accept.certificate.certificate_help import WHEN, certificate_contents

COUNT = 7


def plain_page() -> None:
    canvas = Canvas(io.BytesIO())
    for line in range(60):
        canvas.drawString(50, 50 + 12 * line, "a line of text as long as those of a certificate " * 2)
    canvas.save()


def seconds(job: Callable[[], object]) -> float:
    job()
    began = time.process_time()
    for _ in range(COUNT):
        job()
    return (time.process_time() - began) / COUNT


def main() -> None:
    with TemporaryDirectory() as folder:
        home = Path(folder)
        keys.init(home, "correct horse", "Technician", "Assurance", "battery staple", when=WHEN)
        technician = keys.unlock(home, TECHNICIAN, "correct horse")
        qa = keys.unlock(home, QA, "battery staple")
        made = certificate_contents(home / "unit")
        unsigned = render(made)
        signed = sign(unsigned, technician, WHEN)
        final = sign(signed, qa, WHEN)
        unit = seconds(plain_page)
        jobs: dict[str, Callable[[], object]] = {
            "render": lambda: render(made),
            "sign": lambda: sign(unsigned, technician, WHEN),
            "countersign": lambda: sign(signed, qa, WHEN),
            "verify": lambda: verify_certificate(final, [technician.ca], ports()),
        }
        times = {name: seconds(job) for name, job in jobs.items()}
        print(f"plain page of text: {1e3 * unit:.2f} ms")
        for name, took in times.items():
            print(f"{name:12} {1e3 * took:7.1f} ms   {took / unit:7.1f} plain pages")
        print(f"{COUNT} certificates, all of it: {COUNT * sum(times.values()):.1f} s")


if __name__ == "__main__":
    main()
