"""The model file that a set is judged with: the strut's file and, if a set asks for it, what it states of
shells as they are built. Plain text, so that the contract of the file is tested and not the code that writes one."""

import os
from pathlib import Path

from validation.sets import DAMPING, Set
from validation.shell import matrices
from validation.strut import MODEL_FILE

AFTER_DAMPING = "damping_ratio = { value = 0.010, sd = 0.003 }\n"
AFTER_ARM = "arm_y_mm = { value = 15.0, sd = 0.3 }\n"


def text_for(it: Set) -> str:
    """Return the TOML of the model from which a set is judged."""
    text = _replaced(MODEL_FILE.read_text(), '"APA300ML.mat"', f'"{matrices().resolve().as_posix()}"')
    if it.stated:
        scatter = f"mode_scatter = {{ frequency = {it.stated:g}, damping = {DAMPING:g} }}\n"
        text = _replaced(text, AFTER_DAMPING, AFTER_DAMPING + scatter)
    if it.lopsided:
        both = "".join(f"lopsided_{axis}_um = {{ value = 0.0, sd = 30.0 }}\n" for axis in "xy")
        text = _replaced(text, AFTER_DAMPING, AFTER_DAMPING + both)
    if it.beside:
        ruler = "ruler_arm_x_mm = { value = 4.0, sd = 0.5 }\nruler_arm_y_mm = { value = 15.0, sd = 1.0 }\n"
        text = _replaced(text, AFTER_ARM, AFTER_ARM + ruler)
    return text


def _replaced(text: str, old: str, new: str) -> str:
    if text.count(old) != 1:
        raise ValueError(f"{MODEL_FILE}: {old.strip()!r} stands there {text.count(old)} times, expected once")
    return text.replace(old, new)


def write_model(it: Set, folder: Path) -> Path:
    """Write the file into a folder and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path, part = folder / "model.toml", folder / f"model-{os.getpid()}.toml"
    part.write_text(text_for(it))
    part.replace(path)  # at once, as other processes may read it
    return path
