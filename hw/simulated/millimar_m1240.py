"""A Millimar that speaks M1240 ([MILLIMAR] page 67). Assumed: `P86` is answered by CR; `ERR1` for unknown commands."""

from hw.simulated.device import Source
from hw.simulated.millimar import UNITS, MillimarDevice

CODES = {b"P86,1": "mm", b"P86,2": "in", b"P86,3": "um"}


class M1240Device(MillimarDevice):
    """stored: values for M70, which deletes them. mastering: after Z, silent until its key is pressed."""

    def __init__(
        self,
        source: Source,
        *,
        model: str = "C1216",
        unit: str = "mm",
        acknowledgement: str = "cr",
        stored: tuple[float, ...] = (),
    ) -> None:
        super().__init__(source, model, unit)
        self.stored = list(stored)
        self.mastering = self.running = False
        self._acknowledgement = acknowledgement

    def press_key(self) -> None:
        self.mastering = False

    def answer(self, message: bytes) -> list[bytes]:
        if self.mastering:
            return []
        return [reply + b"\r" for reply in self._replies(message)]

    def _replies(self, message: bytes) -> list[bytes]:
        if message == b"I":
            return [f"I,MAHRGMBH,{self.model},V1.02".encode("ascii")]
        if message in CODES:
            self.set_unit(CODES[message])
            return {"cr": [b""], "echo": [message], "none": []}[self._acknowledgement]
        if message == b"M":
            return [self._value()]
        if message == b"M70":
            values, self.stored = self.stored, []
            return [f"{1:05d}, {v * UNITS[self.unit]:.3f}".encode("ascii") for v in values]
        if message in (b"F1", b"F2", b"F3", b"R", b"Z"):
            self.running = message in (b"F1", b"F2")
            self.mastering = message == b"Z"
            return [message]
        return [b"ERR1"]

    def _of_number(self, number: str) -> str:
        return f"M1, {number}"
