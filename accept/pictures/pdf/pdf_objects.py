"""Objects of a PDF file ([ISO32000-2] 7.3 and 7.5): those of a file that reportlab wrote, numbered anew, and new ones.

A library for any PDF takes as long to load as a page to draw. This module reads what reportlab writes and refuses all
else. It writes as pypdf does, so that certificates of earlier programs are drawn again to the byte."""

import codecs
import math
import re
import string
from collections.abc import Iterable, Iterator, Mapping

from pyhanko.pdf_utils.generic import encode_pdfdocencoding

Entries = dict[bytes, bytes]
"""A dictionary: each key, as b"/Type", and its value as it is written."""

_TOKEN = re.compile(
    rb"\s*(<<|>>|\[|\]|\d+ \d+ R|<[0-9A-Fa-f]*>|\((?:[^()\\]|\\.)*\)|/[^\s/<>\[\]()]*|[+-]?[\d.]+"
    rb"|true|false|null|stream\r?\n)",
    re.DOTALL,
)
_HEADER = b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n"  # the version that knows signatures of this kind; bytes that are no text
_DIGITS = 8  # of a number that is not whole
_PLAIN = (string.ascii_letters + string.digits + " ").encode()


class PdfObjects:
    """A PDF file in the making. Objects are numbered from 1 in the order in which they come; `root` is the first."""

    def __init__(self, pages: bytes) -> None:
        """Take over all objects of a file that reportlab wrote. Raises ValueError if it is written in another way."""
        self._pages = pages
        self._objects: list[tuple[Entries, bytes | None]] = []
        self._numbers: dict[int, int] = {}  # there -> here
        table, _, trailer = pages[int(pages[pages.rindex(b"startxref") :].split()[1]) :].partition(b"trailer")
        self._places = [int(place) for place in re.findall(rb"(\d{10}) \d{5} [fn]", table)]
        self._identifier = re.findall(rb"<[0-9a-f]{32}>", trailer)
        if (named := re.search(rb"/Root (\d+) 0 R", trailer)) is None:
            raise ValueError("no /Root in the trailer of the page's file")
        self._copied(int(named[1]))
        self.root = self._objects[0][0]
        self._information = self.add({})

    def add(self, entries: Mapping[bytes, bytes], stream: bytes | None = None) -> bytes:
        """Add an object, a stream if it has a content; return the reference to it."""
        self._objects.append((dict(entries), stream))
        return b"%d 0 R" % len(self._objects)

    @property
    def first_page(self) -> bytes:
        """Return the reference to the first page."""
        kids = self.entries(self.root[b"/Pages"])[b"/Kids"]
        return kids[2 : kids.index(b"R") + 1]

    def entries(self, reference: bytes) -> Entries:
        """Return the dictionary of an object, to be changed."""
        return self._objects[int(reference.split()[0]) - 1][0]

    def written(self, information: Mapping[bytes, bytes]) -> bytes:
        """Return the file. information: title and the like."""
        self.entries(self._information).update(information)
        parts, places, at = [_HEADER], [], len(_HEADER)
        for number, (entries, stream) in enumerate(self._objects, 1):
            body = dictionary(entries if stream is None else entries | {b"/Length": b"%d" % len(stream)})
            places.append(at)
            content = [] if stream is None else [b"\nstream\n", stream, b"\nendstream"]
            new = [b"%d 0 obj\n" % number, body, *content, b"\nendobj\n"]
            at += sum(map(len, new))
            parts += new
        parts += [b"xref\n0 %d\n0000000000 65535 f \n" % (len(places) + 1), *(b"%010d 00000 n \n" % p for p in places)]
        ends = {b"/Size": b"%d" % (len(places) + 1), b"/Root": b"1 0 R", b"/Info": self._information}
        trailer = dictionary(ends | {b"/ID": array(self._identifier)})
        return b"".join([*parts, b"trailer\n", trailer, b"\nstartxref\n%d\n%%%%EOF\n" % at])

    def _copied(self, number: int) -> bytes:
        """Return the reference to an object of the other file, which is taken over when it is first referred to."""
        if number not in self._numbers:
            own: Entries = {}
            self._objects.append((own, None))
            place = self._numbers[number] = len(self._objects)
            tokens = self._tokens(self._pages.index(b"obj", self._places[number]) + 3)
            if next(tokens)[0] != b"<<":
                raise ValueError(f"object {number} of the page's file is no dictionary")
            own.update(self._pairs(tokens))
            if b"/Length" in own:
                begin, length = next(tokens)[1], int(own.pop(b"/Length"))
                self._objects[place - 1] = (own, self._pages[begin : begin + length])
        return b"%d 0 R" % self._numbers[number]

    def _tokens(self, at: int) -> Iterator[tuple[bytes, int]]:
        """Yield each token from a place on, with the place behind it."""
        while found := _TOKEN.match(self._pages, at):
            at = found.end()
            yield found[1], at
        raise ValueError(
            f"at byte {at} of the page's file: {self._pages[at : at + 20]!r}, which reportlab does not write"
        )

    def _pairs(self, tokens: Iterator[tuple[bytes, int]]) -> Iterator[tuple[bytes, bytes]]:
        for key, _ in tokens:
            if key == b">>":
                return
            yield key, self._value(next(tokens)[0], tokens)

    def _value(self, token: bytes, tokens: Iterator[tuple[bytes, int]]) -> bytes:
        if token == b"<<":
            return dictionary(dict(self._pairs(tokens)))
        if token == b"[":
            return array(self._value(one, tokens) for one in iter(lambda: next(tokens)[0], b"]"))
        if token.endswith(b" R"):
            return self._copied(int(token.split()[0]))
        return decimal(float(token)) if b"." in token and not token.startswith((b"/", b"(")) else token


def dictionary(entries: Mapping[bytes, bytes]) -> bytes:
    """Return a dictionary as it is written."""
    return b"".join([b"<<\n", *(b"%s %s\n" % entry for entry in entries.items()), b">>"])


def array(values: Iterable[bytes]) -> bytes:
    """Return an array as it is written."""
    return b"".join([b"[", *(b" " + value for value in values), b" ]"])


def decimal(x: float) -> bytes:
    """Return a number that need not be whole."""
    if x == 0.0:
        return b"0.0"
    return f"{x:.{max(1, _DIGITS - int(math.log10(abs(x))))}f}".rstrip("0").rstrip(".").encode()


def text(words: str) -> bytes:
    """Return a text string, all but letters and digits by their codes."""
    try:
        encoded: bytes = encode_pdfdocencoding(words)  # type: ignore[no-untyped-call]  # pyhanko leaves it untyped
    except UnicodeEncodeError:
        encoded = codecs.BOM_UTF16_BE + words.encode("utf-16be")
    escaped = (b"%c" % code if b"%c" % code in _PLAIN else b"\\%03o" % code for code in encoded)
    return b"".join([b"(", *escaped, b")"])
