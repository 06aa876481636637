"""A section measured live from the screen of its step: the thread that measures asks and tells through the screen."""

import queue
import threading
from typing import Any

from accept.capture.reading_loop import CaptureStopped
from accept.tui.background.busy_screen import Working
from accept.tui.screens.ask import Question, QuestionLine

LOOK_S = 0.2  # between two looks whether the capture was stopped


class CaptureDialogue:
    """Questions and words of a capture. `ask` and `say` are called from the thread that measures, `stop` from the
    screen."""

    def __init__(self, screen: Working[Any], title: str) -> None:
        self._screen, self._title, self.stopped = screen, title, threading.Event()

    def ask(self, words: str) -> str:
        """Return what a person types. Raises CaptureStopped after Escape, and if the screen was left."""
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
            self.stop()
        raise CaptureStopped("stopped; nothing was entered")

    def say(self, words: str) -> None:
        """Show words in the status line, with a sound if something is to be done now."""
        app = self._screen.app
        app.call_from_thread(self._screen.say, words)
        if words.endswith("now"):
            app.call_from_thread(app.bell)

    def stop(self) -> None:
        self.stopped.set()
