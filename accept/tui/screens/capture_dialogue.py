"""A section measured live from the screen of its step: the thread that measures asks and tells through the screen."""

import queue
import threading
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.text import Text
from textual.widgets import Static

from accept.capture.reading_loop import CaptureStopped
from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Question, QuestionLine
from accept.tui.widgets.hits import Hits

if TYPE_CHECKING:
    from checks.acceptance import HitsSoFar

_HIT = "hit now"
LOOK_S = 0.2  # between two looks whether the capture was stopped
LAST = 3  # words that stay: hits come every second or two, and each of their verdicts is to be read


def is_cue(words: str) -> bool:
    """Return whether words ask for something to be done now: `hit now`, `put the mass on now`."""
    return words.endswith("now")


class CaptureLog:
    """Lines of a measurement. The cue stays until the next or a question; of findings the last lines."""

    def __init__(self) -> None:
        self._cue = ""
        self._last: deque[str] = deque(maxlen=LAST)

    def said(self, words: str) -> list[str]:
        """Return what is shown after words were said: the cue first, the newest last."""
        if is_cue(words):
            self._cue = words
        else:
            self._last.append(words)
        return [*filter(None, (self._cue,)), *self._last]

    def answered(self) -> list[str]:
        """Return what is shown while a question is asked, which is what is to be done now."""
        self._cue = ""
        return list(self._last)


class CaptureDialogue:
    """Questions and words of a capture. `ask` and `say` are called from the thread that measures, `ended` from the
    screen, which sets `stopped`."""

    def __init__(self, screen: Working[Any], title: str, where: str = "") -> None:
        """where: drawing of the places where a hammer hits."""
        self._screen, self._title, self._where, self.stopped = screen, title, where, threading.Event()
        self._log = CaptureLog()

    def ask(self, words: str) -> str:
        """Return what a person types. Raises CaptureStopped after Escape, and if the screen was left."""
        self._screen.app.call_from_thread(self._show, self._log.answered())
        answers: queue.SimpleQueue[list[str] | None] = queue.SimpleQueue()
        question = Question(self._title, words.strip().removesuffix(":"), [QuestionLine("")])
        self._screen.app.call_from_thread(self._screen.app.push_screen, question, answers.put)
        while not self.stopped.is_set():
            try:
                answer = answers.get(timeout=LOOK_S)
            except queue.Empty:
                continue
            if answer is not None:
                return answer[0]
            self.stopped.set()
        raise CaptureStopped("stopped; nothing was entered")

    def say(self, words: str) -> None:
        """Show words above the status line, in which the clock runs, with a sound if something is to be done now."""
        self._screen.app.call_from_thread(self._show, self._log.said(words))
        if is_cue(words):
            self._screen.app.call_from_thread(self._screen.app.bell)

    def show(self, place: str, so_far: "HitsSoFar") -> None:
        """Show the hits so far in the place of the step, beside where to hit."""
        self._screen.app.call_from_thread(self._screen.call_later, self._show_hits, place, so_far)

    async def _show_hits(self, place: str, so_far: "HitsSoFar") -> None:
        if not self._screen.alive:
            return
        if not self._screen.query(Hits):
            await self._screen.mount(Hits(self._where), before="#main")
            self._screen.query_one("#main").display = False
        self._screen.query_one(Hits).show(place, so_far)

    def ended(self) -> None:
        """Take the words away: what became of the capture stands in the status line."""
        self._show(())
        self._screen.query(Hits).remove()
        for main in self._screen.query("#main"):
            main.display = True

    def _show(self, lines: Sequence[str]) -> None:
        lines = [
            line for line in lines if not (line.endswith(_HIT) and self._screen.query(Hits))
        ]  # which show it large
        text = Text("\n".join(lines))
        text.stylize("bold", 0, len(lines[0]) if lines and is_cue(lines[0]) else 0)
        for shown in self._screen.query("#said").results(Static):
            shown.update(text)
            shown.display = bool(lines)
