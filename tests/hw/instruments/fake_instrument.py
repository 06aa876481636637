"""An instrument that answers from a list."""

import threading
from collections.abc import Mapping, Sequence
from typing import Any

from accept.workflow.instruments.port import InstrumentPort, Instruments


class Fake:
    """answers: readings in `unit`, or errors to raise; the last one stays. hold: the first reading waits for
    `let_go`."""

    name = "meter X1 SN-7"
    short_name = "meter (X1)"
    offer = "the reading"

    def __init__(self, answers: Sequence[float | Exception], unit: str = "F", hold: bool = False) -> None:
        self._answers, self._unit, self._hold = list(answers), unit, hold
        self.asked, self.let_go = threading.Event(), threading.Event()

    def mend(self, value: float) -> None:
        """Answer this from now on."""
        self._answers[:] = [value]

    def read(self) -> tuple[float, str]:
        self.asked.set()
        if self._hold:
            self.let_go.wait(30.0)
        answer = self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]
        if isinstance(answer, Exception):
            raise answer
        return answer, self._unit

    def uncertainty(self, value: float) -> float | None:
        return None

    def evidence(self) -> Mapping[str, Any]:
        return {"instrument": "meter", "model": "X1", "serial": "SN-7", "transcript": [[0.0, "read", "4.99"]]}


class Only(Instruments):
    """Instruments of which there is one, for one check."""

    def __init__(self, check: str, instrument: InstrumentPort) -> None:
        self._check, self._instrument = check, instrument

    def serving(self, check: str, name: str, index: int | None) -> InstrumentPort | None:
        return self._instrument if check == self._check else None
