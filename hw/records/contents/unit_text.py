"""Units as other programs write them, in one way of writing."""

import re

WORDS = {"volt": "V", "newton": "N", "meter": "m", "metre": "m", "micron": "um", "hertz": "Hz", "radian": "rad"}
PER_TIME = ("s", "s2", "sec", "min")  # a unit that ends so is a velocity or an acceleration


def plain_unit(text: str) -> str:
    """Return a unit in one way of writing: `m/s^2`, `m/s**2`, `m/s²` and `(m / s2)` are "m/s2"."""
    text = re.sub(r"\*\*|\^", "", text.strip().replace("²", "2").replace("µ", "u").replace("μ", "u"))
    text = re.sub(r"\s*/\s*", "/", text)
    text = re.sub(r"(?<=/)(sec|seconds?)\b", "s", text.replace("/s/s", "/s2"))
    text = re.sub(r"/sec2\b", "/s2", text)
    text = re.sub(r"[A-Za-z]+", lambda word: WORDS.get(word[0].lower().removesuffix("s"), word[0]), text)
    return text[1:-1].strip() if re.fullmatch(r"\([^()]*\)", text) else text


def split_ratio(text: str) -> tuple[str, str]:
    """Return the unit of a channel and that of its input: `(m/s^2)/N` is ("m/s2", "N"), `m/s2` is ("m/s2", "")."""
    depth, parts = 0, [""]
    for letter in plain_unit(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "/" and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    parts = [plain_unit(part) for part in parts]
    if len(parts) == 1 or parts[-1] in PER_TIME:
        return "/".join(parts), ""
    return "/".join(parts[:-1]), parts[-1]
