"""Is a value in DER, the one canonical encoding of ASN.1? (X.690, 8 and 10)"""

from collections.abc import Iterator

_BOOLEAN, _INTEGER, _BIT_STRING, _NULL, _OID, _SEQUENCE, _SET = 0x01, 0x02, 0x03, 0x05, 0x06, 0x10, 0x11
_CONSTRUCTED, _UNIVERSAL, _LONG_TAG = 0x20, 0x00, 0x1F
_DEEPEST = 40  # a certificate nests a dozen levels


class NotCanonical(ValueError):
    """Bytes that are not DER; the text says what is wrong with them."""


def check(content: bytes, depth: int = 0) -> None:
    """Raises NotCanonical unless `content` is values in DER, one after the other, to its end."""
    if depth > _DEEPEST:
        raise NotCanonical("is nested too deeply")
    for tag, inner, _ in values(content):
        if tag & 0xC0 == _UNIVERSAL and bool(tag & _CONSTRUCTED) != ((tag & 0x1F) in (_SEQUENCE, _SET)):
            raise NotCanonical("has a value in pieces")
        if tag & _CONSTRUCTED:
            check(inner, depth + 1)
        if tag == _CONSTRUCTED | _SET:
            _check_set(inner)
        elif tag & 0xE0 == _UNIVERSAL:
            _check_primitive(tag, inner)


def values(content: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """(tag, contents, whole encoding) of each value; short tags and shortest lengths only."""
    at = 0
    while at < len(content):
        if len(content) - at < 2 or content[at] & 0x1F == _LONG_TAG:
            raise NotCanonical("ends within a value or has an unknown tag")
        tag, length, start = content[at], content[at + 1], at + 2
        if length >= 0x80:
            digits = content[start : start + (length & 0x7F)]
            length, start = int.from_bytes(digits, "big"), start + len(digits)
            if not digits or digits[0] == 0 or length < 0x80 or len(digits) > 4:
                raise NotCanonical("has a length that is not in its shortest form")
        if start + length > len(content):
            raise NotCanonical("is longer than its place")
        yield tag, content[start : start + length], content[at : start + length]
        at = start + length


def _check_set(inner: bytes) -> None:
    encodings = [whole for _, _, whole in values(inner)]
    if encodings != sorted(encodings):
        raise NotCanonical("has a set that is not sorted")


def _check_primitive(tag: int, inner: bytes) -> None:
    kind = tag & 0x1F
    if kind in (_BOOLEAN, _INTEGER, _BIT_STRING) and not inner:
        raise NotCanonical("has an empty number")
    if kind == _BOOLEAN and inner not in (b"\x00", b"\xff"):
        raise NotCanonical("has a boolean that is neither 00 nor FF")
    if kind == _INTEGER and len(inner) > 1 and (inner[0], inner[1] >> 7) in ((0x00, 0), (0xFF, 1)):
        raise NotCanonical("has an integer with a byte too many")
    if kind == _BIT_STRING and (inner[0] > 7 or (inner[-1] if len(inner) > 1 else 0) & ((1 << inner[0]) - 1)):
        raise NotCanonical("has a bit string with loose bits")
    if kind == _NULL and inner:
        raise NotCanonical("has a null that holds something")
    if kind == _OID and (not inner or inner[-1] & 0x80 or inner[0] == 0x80):
        raise NotCanonical("has a damaged object identifier")
