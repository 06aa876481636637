"""Files that try to stop or to fill the machine that verifies them: made by hand, and mutations of a signed one.

As a program it verifies every file of a folder as `accept verify` does, and tells what each took."""

import json
import random
import re
import resource
import sys
import time
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

FORM = b"<< /Type /Catalog /Pages 2 0 R /AcroForm << /Fields %b /SigFlags 3 >> %b >>"
PAGES = b"<< /Type /Pages /Kids [] /Count 0 >>"


def plain(objects: Mapping[int, bytes], trailer: bytes = b"", size: int | None = None) -> bytes:
    """Return a PDF of these objects with a plain table of them."""
    out, at = bytearray(b"%PDF-1.7\n"), {}
    for number, body in objects.items():
        at[number] = len(out)
        out += b"%d 0 obj\n%b\nendobj\n" % (number, body)
    place, last = len(out), max(objects) + 1
    rows = b"".join(b"%010d 00000 n \n" % at.get(n, 9) for n in range(1, last))
    out += b"xref\n0 %d\n0000000000 65535 f \n" % last + rows
    return bytes(
        out + b"trailer\n<< /Size %d /Root 1 0 R %b>>\nstartxref\n%d\n%%%%EOF\n" % (size or last, trailer, place)
    )


def table(tail: bytes) -> bytes:
    """Return a PDF whose table of objects and trailer are these bytes; AT in them is its place."""
    head = b"%%PDF-1.7\n1 0 obj\n%b\nendobj\n2 0 obj\n%b\nendobj\n" % (FORM % (b"[]", b""), PAGES)
    return head + tail.replace(b"AT", b"%d" % len(head))


def streamed(dictionary: bytes, data: bytes) -> bytes:
    """Return a PDF with a cross-reference stream."""
    words = b"3 0 obj\n<< /Type /XRef /Root 1 0 R /Length %d %b >>\nstream\n" % (len(data), dictionary)
    return table(words + data + b"\nendstream\nendobj\nstartxref\nAT\n%%EOF\n")


def form(fields: bytes, more: bytes = b"", **objects: bytes) -> bytes:
    """Return a PDF whose form has these fields; objects: `o3=...` is number 3."""
    return plain({1: FORM % (fields, more), 2: PAGES} | {int(name[1:]): body for name, body in objects.items()})


def signed_by(contents: bytes, byte_range: bytes = b"[0 10 20 30]", more: bytes = b"") -> bytes:
    """Return a PDF with a signature of the technician."""
    value = b"<< /Type /Sig /Filter /Adobe.PPKLite /SubFilter /ETSI.CAdES.detached /ByteRange %b /Contents %b %b >>"
    field = b"<< /T (technician) /FT /Sig /V 4 0 R >>"
    first = form(b"[3 0 R]", o3=field, o4=value % (byte_range, contents, more))
    at = len(first)
    again = b"4 0 obj\n%b\nendobj\n" % (value % (byte_range, contents, more))
    previous = int(first.split()[-2])
    tail = b"xref\n4 1\n%010d 00000 n \ntrailer\n<< /Size 5 /Root 1 0 R /Prev %d >>\nstartxref\n%d\n%%%%EOF\n"
    return first + again + tail % (at, previous, at + len(again))


def chained(count: int) -> bytes:
    """Return a file of very many revisions."""
    out, previous = bytearray(table(b"")), b""
    for _ in range(count):
        at = len(out)
        out += b"xref\n0 1\n0000000000 65535 f \ntrailer\n<< /Size 3 /Root 1 0 R %b>>\nstartxref\n%d\n%%%%EOF\n" % (
            previous,
            at,
        )
        previous = b"/Prev %d " % at
    return bytes(out)


def flated(content: bytes, times: int) -> bytes:
    for _ in range(times):
        content = zlib.compress(content, 9)
    return content


def fields_of_fields(depth: int) -> bytes:
    """Return a form with 2^depth paths through it."""
    levels = {f"o{n}": b"<< /T (a) /Kids [%d 0 R %d 0 R] >>" % (n + 1, n + 1) for n in range(3, depth)}
    return form(b"[3 0 R]", **levels, **{f"o{depth}": b"<< /T (technician) /FT /Sig >>"})


_ROW, _TRAILER = b"0000000000 65535 f \n", b"trailer\n<< /Size 3 /Root 1 0 R %b >>\nstartxref\nAT\n%%%%EOF\n"
_DEEP = 300_000
_BOMB = b"<< /Type /Catalog /Length 9 /Filter [%b] >>\nstream\nxxxxxxxxx\nendstream"


def _entries() -> bytes:
    return b"\1\0\0\0" * 50_000_000


HAND_MADE: Mapping[str, Callable[[], bytes]] = {
    "index of milliards": lambda: streamed(b"/Size 2000000000 /Index [0 2000000000] /W [0 0 0]", b""),
    "milliards of one byte": lambda: streamed(b"/Size 2000000000 /Index [0 2000000000] /W [1 0 0]", b"\1" * 20),
    "index repeated": lambda: streamed(b"/Size 100 /Index [" + b"0 50000000 " * 3 + b"] /W [0 0 0]", b""),
    "index repeated often": lambda: streamed(b"/Size 100 /Index [" + b"0 100 " * 300_000 + b"] /W [0 0 0]", b""),
    "deflated table": lambda: streamed(b"/Size 50000000 /W [1 2 1] /Filter /FlateDecode", flated(_entries(), 1)),
    "twice deflated table": lambda: streamed(
        b"/Size 50000000 /W [1 2 1] /Filter [/FlateDecode /FlateDecode]", flated(_entries(), 2)
    ),
    "negative index": lambda: streamed(b"/Size 10 /Index [-5 2000000000] /W [0 0 0]", b""),
    "wide entries": lambda: streamed(b"/Size 10 /W [1 1000000000 1]", b"\1" * 40),
    "hybrid table": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % b"/XRefStm 9"),
    "escaped key": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % b"/#50rev 9"),
    "table of milliards": lambda: table(b"xref\n0 2000000000\n" + _ROW + _TRAILER % b""),
    "first of milliards": lambda: table(b"xref\n2000000000 1\n" + _ROW + _TRAILER % b""),
    "parts of no rows": lambda: table(b"xref\n" + b"0 0\n" * 2_000_000 + _TRAILER % b""),
    "parts of one row": lambda: table(b"xref\n" + (b"0 1\n" + _ROW) * 500_000 + _TRAILER % b""),
    "rows as promised": lambda: table(b"xref\n0 5000000\n" + _ROW * 5_000_000 + _TRAILER % b""),
    "size of milliards": lambda: plain({1: FORM % (b"[]", b""), 2: PAGES}, size=2_000_000_000),
    "table of itself": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % b"/Prev AT"),
    "earlier table behind": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % b"/Prev 999999999"),
    "two earlier tables": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % b"/Prev 9 /Prev 10"),
    "long trailer": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % (b"/ID [" + b"<00>" * 2_000_000 + b"]")),
    "spaces in trailer": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % (b" " * 50_000_000)),
    "nested trailer": lambda: table(b"xref\n0 1\n" + _ROW + _TRAILER % (b"/A " + b"<< /A " * _DEEP)),
    "thousands of revisions": lambda: chained(3000),
    "nine revisions": lambda: chained(9),
    "thousands of ends": lambda: table(b"startxref\n0\n%%EOF\n" * 300_000),
    "ends without a table": lambda: b"%PDF-1.7\n" + b"%%EOF\n" * 2_000_000,
    "nested arrays": lambda: plain({1: b"[" * _DEEP + b"]" * _DEEP, 2: PAGES}),
    "arrays left open": lambda: plain({1: b"[" * 20_000_000, 2: PAGES}),
    "nested dictionaries": lambda: plain({1: b"<</A " * _DEEP + b"1" + b">>" * _DEEP, 2: PAGES}),
    "nested fields": lambda: form(b"[" * _DEEP + b"]" * _DEEP),
    "millions of fields": lambda: form(b"[" + b"3 0 R " * 2_000_000 + b"]", o3=b"<< /T (technician) /FT /Sig >>"),
    "millions of numbers": lambda: form(b"[]", b"/A [" + b"1 " * 20_000_000 + b"]"),
    "millions of keys": lambda: form(b"[]", b"".join(b"/A%d 1 " % n for n in range(1_000_000))),
    "fields of fields": lambda: fields_of_fields(60),
    "field of itself": lambda: form(b"[3 0 R]", o3=b"<< /T (qa) /FT /Sig /Kids [3 0 R] /Parent 3 0 R >>"),
    "parent of itself": lambda: form(b"[3 0 R]", o3=b"<< /T (technician) /Parent 3 0 R >>"),
    "reference to itself": lambda: form(b"3 0 R", o3=b"3 0 R"),
    "chain of references": lambda: form(b"3 0 R", **{f"o{n}": b"%d 0 R" % (n + 1) for n in range(3, 9000)}),
    "catalogue of itself": lambda: plain({1: b"1 0 R", 2: PAGES}),
    "form in a long stream": lambda: form(b"[]", o3=b"<< /Length 2000000000 >>\nstream\nx\nendstream"),
    "catalogue is a bomb": lambda: plain({1: _BOMB % (b"/FlateDecode " * 1000), 2: PAGES}),
    "long string": lambda: form(b"[]", b"/A (" + b"(" * 20_000_000 + b")" * 20_000_000 + b")"),
    "long name": lambda: form(b"[]", b"/" + b"A" * 50_000_000 + b" 1"),
    "long number": lambda: form(b"[]", b"/A " + b"9" * 5_000_000),
    "long comment": lambda: form(b"[]", b"%" + b"x" * 50_000_000 + b"\n"),
    "long spaces": lambda: form(b"[]", b" " * 50_000_000),
    "encrypted slowly": lambda: plain(
        {1: FORM % (b"[]", b""), 2: PAGES, 3: b"<< /Filter /Standard /V 5 /R 6 >>"}, b"/Encrypt 3 0 R "
    ),
    "contents of zeros": lambda: signed_by(b"<" + b"0" * 40_000_000 + b">"),
    "contents nested": lambda: signed_by(b"<" + b"3080" * 2_000_000 + b">"),
    "contents of a long length": lambda: signed_by(b"<30847FFFFFFF" + b"00" * 1000 + b">"),
    "range of millions": lambda: signed_by(b"<00>", b"[" + b"0 1 " * 3_000_000 + b"]"),
    "range of milliards": lambda: signed_by(b"<00>", b"[0 2000000000 2000000001 2000000000]"),
}


def mutated(pdf: bytes, seed: int) -> bytes:
    """Return a file with one to three changes."""
    rng = random.Random(seed)
    for _ in range(rng.randint(1, 3)):
        pdf = rng.choice(_CHANGES)(pdf, rng)
    return pdf


def _flipped(pdf: bytes, rng: random.Random) -> bytes:
    out = bytearray(pdf)
    for _ in range(rng.randint(1, 40)):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _cut(pdf: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(pdf))
    return pdf[:at] + pdf[at + rng.randint(1, 20_000) :]


def _doubled(pdf: bytes, rng: random.Random) -> bytes:
    at, size = rng.randrange(len(pdf)), rng.randint(1, 20_000)
    return pdf[: at + size] + pdf[at : at + size] * rng.randint(1, 50) + pdf[at + size :]


def _renumbered(pdf: bytes, rng: random.Random) -> bytes:
    """Change a number of the tables and trailers, or of any dictionary."""
    tables = [m.span() for m in re.finditer(rb"xref\n.*?%%EOF", pdf, re.DOTALL)] or [(0, len(pdf))]
    start, end = rng.choice(tables)
    numbers = [m.span() for m in re.finditer(rb"\d+", pdf[start:end])]
    if not numbers:
        return pdf
    first, last = rng.choice(numbers)
    number = str(rng.choice([0, 1, 9, 2**31 - 1, 2_000_000_000, 9_999_999, rng.randrange(len(pdf))])).encode()
    width = last - first if rng.random() < 0.5 else 0
    return pdf[: start + first] + number.rjust(width, b"0") + pdf[start + last :]


def _grown(pdf: bytes, rng: random.Random) -> bytes:
    return _replaced(
        pdf,
        rng,
        rb"/(?:Length|Size|Count|N|P) \d+",
        lambda found: found.split()[0] + b" %d" % rng.choice([0, 10**6, 2 * 10**9, 10**18]),
    )


def _filtered(pdf: bytes, rng: random.Random) -> bytes:
    names = [b"/FlateDecode", b"/ASCII85Decode", b"/ASCIIHexDecode", b"/LZWDecode", b"/RunLengthDecode", b"/Crypt"]
    chain = b" ".join(rng.choices(names, k=rng.choice([1, 3, 200])))
    return _replaced(pdf, rng, rb"/Filter (?:\[[^\]]*\]|/\w+)", lambda _: b"/Filter [" + chain + b"]")


def _reworded(pdf: bytes, rng: random.Random) -> bytes:
    keys = [
        b"/Kids",
        b"/Fields",
        b"/AcroForm",
        b"/Parent",
        b"/V",
        b"/Type",
        b"/Filter",
        b"/Root",
        b"/Names",
        b"/Contents",
    ]
    return _replaced(
        pdf, rng, rb"/(?:Kids|Fields|AcroForm|Annots|V|Type|Root|Info|Names|AF|Contents)\b", lambda _: rng.choice(keys)
    )


def _replaced(pdf: bytes, rng: random.Random, pattern: bytes, change: Callable[[bytes], bytes]) -> bytes:
    found = [m.span() for m in re.finditer(pattern, pdf)]
    if not found:
        return pdf
    start, end = rng.choice(found)
    return pdf[:start] + change(pdf[start:end]) + pdf[end:]


_CHANGES = (_flipped, _cut, _doubled, _renumbered, _grown, _filtered, _reworded)


def _own_peak_kB() -> int:
    """Return the largest memory of this process; the figure of `getrusage` goes over from the process that started
    it."""
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM"))


def main(folder: Path, authority: Path) -> None:
    """Print for every file, in JSON: its exit code, its lines, the seconds of computing of all processes, the MB of
    the largest until then."""
    from typer.testing import CliRunner

    from accept.cli.main import app

    runner = CliRunner()
    whoever = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    for path in sorted(folder.iterdir()):
        began, before = time.monotonic(), [resource.getrusage(who) for who in whoever]
        done = runner.invoke(app, ["verify", str(path), "--trust", str(authority)])
        after = [resource.getrusage(who) for who in whoever]
        took = sum(b.ru_utime + b.ru_stime - a.ru_utime - a.ru_stime for a, b in zip(before, after, strict=True))
        told = {
            "file": path.name,
            "exit": done.exit_code,
            "out": done.stdout,
            "raised": repr(done.exception) if done.exception and not isinstance(done.exception, SystemExit) else "",
            "seconds": took,
            "wall": time.monotonic() - began,
            "MB": max(_own_peak_kB(), after[1].ru_maxrss) / 1000,  # most memory of a copy is that of the program
        }
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
