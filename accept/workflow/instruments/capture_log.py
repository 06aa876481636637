"""What a capture says while it runs, as it stays on the screen: what to do now, and what was found last."""

from collections import deque

LAST = 3  # words that stay: hits come every second or two, and each of their verdicts is to be read


def is_cue(words: str) -> bool:
    """Return whether words ask for something to be done now: `hit now`, `put the mass on now`."""
    return words.endswith("now")


class CaptureLog:
    """The cue stays until another one comes or a question is asked; of what was found, the last words stay."""

    def __init__(self) -> None:
        self._cue = ""
        self._last: deque[str] = deque(maxlen=LAST)

    def said(self, words: str) -> list[str]:
        """Return what is shown after words were said: the cue first, the newest last."""
        if is_cue(words):
            self._cue = words
        else:
            self._last.append(words)
        return self.lines

    def answered(self) -> list[str]:
        """Return what is shown while a question is asked, which is what is to be done now."""
        self._cue = ""
        return self.lines

    @property
    def lines(self) -> list[str]:
        return [*([self._cue] if self._cue else []), *self._last]
