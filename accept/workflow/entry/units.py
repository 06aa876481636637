"""Units as people write them, and the factor between two of the same kind."""

PREFIXES = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
BASES = frozenset({"F", "m", "Hz", "V", "s", "ohm", "N", "g", "rad"})
ALIASES = {"\u03a9": "ohm", "\u2126": "ohm", "Ohm": "ohm", "Ohms": "ohm", "ohms": "ohm"}  # Greek omega, ohm sign
SAME = {"%": "percent", "°": "deg", "": "1"}


class UnitMismatch(ValueError):
    """A unit that is not of the kind that is asked for."""


def factor(given: str, wanted: str) -> float:
    """What a number in `given` is multiplied with to be in `wanted`, both as written: `factor("nF", "uF")` is 1e-3.

    Raises UnitMismatch naming both.
    """
    given, wanted = (SAME.get(unit, unit) for unit in (given.strip(), wanted))
    if given.lower().replace("µ", "u").replace("μ", "u") == wanted.lower():
        return 1.0
    mine, theirs = _parts(given), _parts(wanted)
    if mine is None or theirs is None or mine[1] != theirs[1]:
        raise UnitMismatch(f"{given} does not fit here; use {wanted}")
    return mine[0] / theirs[0]


def _parts(unit: str) -> tuple[float, tuple[str, ...]] | None:
    """Scale to the base units, and those in order: `N/um` is (1e6, ("N", "m"))."""
    scale, bases = 1.0, []
    for place, word in enumerate(unit.split("/")):
        found = _simple(word.strip())
        if found is None:
            return None
        scale = scale * found[0] if place == 0 else scale / found[0]
        bases.append(found[1])
    return scale, tuple(bases)


def _simple(word: str) -> tuple[float, str] | None:
    word = _plain(word)
    if word in BASES:
        return 1.0, word
    prefix, base = word[:1], _plain(word[1:])
    return (PREFIXES[prefix], base) if prefix in PREFIXES and base in BASES else None


def _plain(word: str) -> str:
    return ALIASES.get(word, word)
