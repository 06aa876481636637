"""Methods that can be put to the test: those of this package by name, a function, or a command.

A method gets a unit's folder and a model file and answers in the form of gap.json: a verdict, the effects that it names
with values and 95 % intervals, and classes of effects that it cannot tell apart.
"""

import importlib
import json
import shlex
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

METHODS: Mapping[str, str] = {
    "gap": "accept.gap.analyse_unit:run_gap",
    "sensitivity": "validation.methods.sensitivity:run",
    "sparse": "validation.methods.sparse:run",
    "evidence": "validation.methods.evidence:run",
}
PATIENCE_S = 900.0
UNIT, MODEL, WITHOUT = "{unit}", "{model}", "{without}"


class Method(Protocol):
    """Folder and model file in, gap.json as a mapping out. without: effects that the library is to do without."""

    def __call__(self, folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]: ...


class MethodError(RuntimeError):
    """A command that ended with an error or did not print an answer."""


@dataclass(frozen=True)
class Command:
    """A program as a method. line: words of its command with {unit}, {model} and, if it has a library to take effects
    from, {without}, their names separated by commas. It prints the answer as JSON."""

    line: str

    def __call__(self, folder: Path, model: Path, *, without: Sequence[str] = ()) -> Mapping[str, Any]:
        given = {UNIT: str(folder), MODEL: str(model), WITHOUT: ",".join(without)}
        words = shlex.split(self.line)
        for mark, value in given.items():
            words = [word.replace(mark, value) for word in words]
        done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        if done.returncode:
            raise MethodError(f"{words[0]}: exit {done.returncode}: {done.stderr.strip()[-500:]}")
        try:
            answer = json.loads(done.stdout)
        except json.JSONDecodeError as e:
            raise MethodError(f"{words[0]}: expected JSON on stdout, got {done.stdout[:80]!r}") from e
        return answer_of(answer)


def method_of(text: str) -> Method:
    """Return a method by its name, as `module:function`, as `module:maker@argument` (what `maker` returns for the
    argument), or from a command line with {unit} in it. Raises MethodError."""
    if UNIT in text:
        return Command(text)
    place, _, argument = METHODS.get(text, text).partition("@")
    module, _, name = place.partition(":")
    if not name:
        raise MethodError(f"method '{text}': expected {', '.join(METHODS)}, module:function, or a command with {UNIT}")
    function = getattr(importlib.import_module(module), name)
    return function(argument) if argument else function  # type: ignore[no-any-return]


def answer_of(answer: Any) -> Mapping[str, Any]:
    """Return an answer that has the keys that are scored. Raises MethodError naming the first that it lacks."""
    if not isinstance(answer, dict) or not isinstance(answer.get("verdict"), str):
        raise MethodError("the answer is expected to be an object with a 'verdict'")
    for k, each in enumerate(answer.get("named", ())):
        if not isinstance(each, dict) or "effect" not in each:
            raise MethodError(f"named[{k}]: expected an object with 'effect' and 'parameters'")
        for p, value in each.get("parameters", {}).items():
            if not isinstance(value, dict) or "value" not in value or len(value.get("ci95", ())) != 2:
                raise MethodError(f"named[{k}].parameters.{p}: expected value and ci95 = [lo, hi]")
    return answer
