"""Serials that are taken for one another.

Those that differ only in capitals are refused: on a file system that does not distinguish them, their certificates and
folders would overwrite each other. Those that differ by characters that look alike (A-10, A-1O; A-W, A-VV), by leading
zeros or by separators that part no digits (B-1, B-01, B_1, B1) are asked about."""

import re

# Letters, in lower case, and what looks like them.
LOOKS = {"o": "0", "i": "1", "l": "1", "z": "2", "s": "5", "g": "6", "b": "8", "w": "vv"}
_LOOKS = str.maketrans(LOOKS)
UNSEEN = "-_.0"  # left out of the key of the index: any of them may be a separator or a leading zero
# A serial names files and goes into a QR code: nothing that a file system or a shell could misread.
SERIAL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in range(1, 10))}


def serial_problem(serial: str) -> str | None:
    """Return why a text cannot be a serial, None if it can."""
    if not SERIAL.fullmatch(serial):
        return "expected 1 to 64 letters, digits, '.', '_' or '-', the first a letter or digit"
    if serial.split(".")[0].upper() in _DEVICES or serial.endswith("."):
        return "Windows keeps this name for itself, so no certificate can bear it"
    return None


def spelling_key(serial: str) -> str:
    """Return the key of all serials that differ only in capitals. A serial is ASCII: no letter has two forms."""
    return serial.casefold()


def look_key(serial: str) -> str:
    """Return the key of all serials that look alike. The store has an index of it (`accept.store.tables`)."""
    return _looks(serial).translate(str.maketrans("", "", UNSEEN))


def look_alike(serial: str, other: str) -> bool:
    """Return whether two serials are easily confused. Not B-8 and 8-B: a letter for a digit, and also the reverse."""
    if _looks(serial) == _looks(other):
        one, two = (spelling_key(each).replace("w", LOOKS["w"]) for each in (serial, other))
        pairs = [(a, b) for a, b in zip(one, two, strict=True) if a.isdigit() != b.isdigit()]
        return len({a.isdigit() for a, _ in pairs}) < 2
    return _plain(serial) == _plain(other)


def _looks(serial: str) -> str:
    return spelling_key(serial).translate(_LOOKS)


def _plain(serial: str) -> str:
    """Return a serial without leading zeros, and with separators between two digits only."""
    without_zeros = re.sub(r"(?<!\d)0+(?=\d)", "", spelling_key(serial))
    return re.sub(r"(?<!\d)-|-(?!\d)", "", re.sub(r"[-_.]+", "-", without_zeros)).translate(_LOOKS)


def mistaken_for(serial: str, known: str) -> str:
    """Return the message that refuses a serial that differs in capitals."""
    return (
        f"serial = '{serial}' differs from '{known}', which the bench's store knows, in capitals only; "
        "some file systems take both for one, and the certificates would overwrite each other"
    )


def difference(serial: str, known: str) -> str:
    """Return in words where a serial differs from one that looks like it."""
    if _looks(serial) != _looks(known):
        return f"{serial} differs from {known}, which the store knows, in leading zeros or separators"
    if len(serial) != len(known):
        return f"{serial} differs from {known}, which the store knows, in VV and W"
    pairs = enumerate(zip(serial, known, strict=True), 1)
    apart = [f"character {i} is the {_kind(a)} {a}, not the {_kind(b)} {b}" for i, (a, b) in pairs if a != b]
    return f"{serial} differs from {known}, which the store knows: {'; '.join(apart)}"


def _kind(character: str) -> str:
    return "digit" if character.isdigit() else "letter"
