"""A turn of a dialogue: the state, effects and words that follow from one event."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

S = TypeVar("S")

# Effects of every dialogue. SELECT: the text of the present line, which is replaced by what is typed next.
Common = Enum("Common", "BELL SELECT")
P = ParamSpec("P")


@dataclass(frozen=True)
class FootWords:
    """The line at the foot. role: quiet, saved, doubt, good, bad."""

    text: str
    role: str = "quiet"


@dataclass(frozen=True)
class Toast:
    """Words about what was done, which go by themselves. title: what it was, and when."""

    title: str
    text: str = ""


@dataclass(frozen=True)
class Turn(Generic[S]):
    """The state that follows, the effects in order, and the words to show, None to leave the present ones."""

    state: S
    effects: tuple[Any, ...] = ()
    words: FootWords | None = None

    def then(self, event: "Callable[Concatenate[S, P], Turn[S]]", *data: P.args, **named: P.kwargs) -> "Turn[S]":
        """Return this turn and what follows from another event as one."""
        following = event(self.state, *data, **named)
        return replace(following, effects=self.effects + following.effects, words=following.words or self.words)


def by_key(answers: Mapping[str, Callable[[S], Turn[S]]]) -> Callable[[S, str], Turn[S]]:
    """Return the function that answers a key."""
    return lambda state, key: answers[key](state)
