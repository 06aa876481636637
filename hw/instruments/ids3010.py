"""Attocube IDS3010, the interferometer on the network: displacement of one axis.

Known from the maker's published client libraries: JSON-RPC 2.0 on TCP port 9090, a line each; a request has `method`,
`params`, `id` and `api`; the result is a list whose first entry is an error number, 0 for none. Of
`com.attocube.ids`: `displacement.getAxisDisplacement` [axis] gives picometres from where the axis was last reset,
`displacement.getMeasurementEnabled`, `displacement.getSignalQuality` [axis] the contrast in permille while it measures,
`displacement.getReferencePosition` [axis] where the axis was last reset, `axis.getPassMode` 0 for single and 1 for
dual pass. Of `com.attocube.system`: `getSerialNumber`, `getDeviceName`.
Assumed: that with `api` 2 every result begins with the error number."""

import itertools
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, SettingsError
from hw.instruments.driver import Ask, Driver, Instrument, Trial, settings_of
from hw.instruments.length import LengthInstrument, LengthSettings
from hw.instruments.reading import Identity, Reading, check_identity, check_unchanged
from hw.link import Deadline, Link
from hw.network_port import Address, open_tcp
from specs.bench import InstrumentEntry

END = b"\n"
SYSTEM, IDS = "com.attocube.system", "com.attocube.ids"
NOT_TOLD = "not told"
PICOMETRE = 1e-12  # unit in which it sends a displacement [m]


class Ids3010Settings(LengthSettings):
    """axis : 0, 1 or 2, whose sensor head looks at the strut. contrast_permille : least signal contrast. pass_mode : of
    the optics, 0 single pass, 1 dual pass: the wrong one halves or doubles the displacement."""

    axis: Annotated[int, Field(ge=0, le=2)]
    pass_mode: Annotated[int, Field(ge=0, le=1)]
    contrast_permille: Annotated[int, Field(ge=0, le=1000)] = 200


class Ids3010(LengthInstrument[Ids3010Settings]):
    """Displacement [m] since the axis was last reset. Nothing is set."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._numbers = itertools.count(1)
        self._next_question = itertools.cycle(
            (self._measuring, self._pass_mode, self._contrast, self._reference, self._averaging, self._serial)
        )

    def _start(self, deadline: Deadline) -> None:
        """Open a new connection, so that no late answer to an earlier question is taken."""
        self.link.close()
        super()._start(deadline)

    def _identify(self, deadline: Deadline) -> Identity:
        name, serial = (str(self._call(f"{SYSTEM}.{what}", deadline)) for what in ("getDeviceName", "getSerialNumber"))
        return Identity(None, serial, None, name)

    def _ask_settings(self, deadline: Deadline) -> Mapping[str, str]:
        """Return pass mode, axis and the place of its last reset. Raises InstrumentRefused, Implausible for low
        contrast."""
        stated: dict[str, str] = {}
        for question in (self._measuring, self._pass_mode, self._contrast, self._reference, self._averaging):
            stated |= question(deadline)
        return stated | {"axis": str(self.settings.axis)}

    def _measuring(self, deadline: Deadline) -> Mapping[str, str]:
        if self._call(f"{IDS}.displacement.getMeasurementEnabled", deadline) is not True:
            raise InstrumentRefused(f"{self.name}: its measurement is not running; start it and align the sensor head")
        return {}

    def _pass_mode(self, deadline: Deadline) -> Mapping[str, str]:
        mode = self._call(f"{IDS}.axis.getPassMode", deadline)
        if type(mode) is not int or mode != self.settings.pass_mode:
            raise Implausible(f"{self.name}: its pass mode is {mode!r}, the bench file has {self.settings.pass_mode}")
        return {"pass mode": str(mode)}

    def _contrast(self, deadline: Deadline) -> Mapping[str, str]:
        contrast = self._call(f"{IDS}.displacement.getSignalQuality", deadline, self.settings.axis)
        if type(contrast) is not int or contrast < self.settings.contrast_permille:
            raise Implausible(
                f"{self.name}: the contrast of axis {self.settings.axis} is {contrast!r} permille: align it"
            )
        return {}

    def _reference(self, deadline: Deadline) -> Mapping[str, str]:
        """Return the position of the axis's last reset: a reset in the middle of a record looks like a step."""
        reference = self._optional_answer("getReferencePosition", deadline, self.settings.axis)
        return {"reference position": reference if reference == NOT_TOLD else f"{reference} pm"}

    def _averaging(self, deadline: Deadline) -> Mapping[str, str]:
        """Return N of the averaging over 2^N times 40 ns, which smears a step by up to 0.7 s."""
        return {"averaging N": self._optional_answer("getAverageN", deadline)}

    def _optional_answer(self, what: str, deadline: Deadline, *params: object) -> str:
        """Return the answer to a question that older interfaces refuse."""
        try:
            return str(self._call(f"{IDS}.displacement.{what}", deadline, *params))
        except InstrumentRefused:
            return NOT_TOLD

    def _serial(self, deadline: Deadline) -> Mapping[str, str]:
        serial = str(self._call(f"{SYSTEM}.getSerialNumber", deadline))
        check_identity(self.name, Identity(serial=serial), None, self.serial)
        return {"serial": serial}

    def _measure(self, deadline: Deadline) -> Reading:
        answer = self._call(f"{IDS}.displacement.getAxisDisplacement", deadline, self.settings.axis)
        if type(answer) not in (int, float):
            raise Garbled(f"{self.name}: its displacement is {answer!r}, expected a number of picometres")
        raw = str(answer).encode("ascii")
        metres = self.settings.plausible(self.name, raw, float(answer) * PICOMETRE)
        return Reading(metres, self.unit, self._now(), (raw,))

    def sample(self) -> Reading:
        """Return one answer of a moving value; a line of the network is whole or lost, so a second one is not needed.

        One question on identity or settings follows each answer, another one each time: all of them at each value would
        take six round trips, and a slow network would leave gaps. `connect` and `confirm` ask all of them. Raises
        InstrumentError."""
        deadline = self.link.deadline(self.deadline_s)
        with self._session_ends_on_error():
            if not self._in_session:
                raise NoReply(f"{self.name}: the connection was lost; begin the record again")
            reading = self._measure(deadline)
            stated = next(self._next_question)(deadline)
            check_unchanged(self.name, self.asked, stated)
            self.asked = {**self.asked, **stated}
            return replace(reading, settings=stated)

    def _call(self, method: str, deadline: Deadline, *params: object) -> Any:
        """Return the first value of a method's result. Raises InstrumentRefused for its errors, else Garbled."""
        number = next(self._numbers)
        line = self._ask(request(method, number, *params), END, deadline)
        return first_value(self.name, line, method, number)


def request(method: str, number: int, *params: object) -> bytes:
    """Return the line that calls a method. number: of the question, which its answer repeats."""
    call = {"jsonrpc": "2.0", "method": method, "params": list(params), "id": number, "api": 2}
    return json.dumps(call).encode("ascii") + b"\r\n"


def first_value(who: str, line: bytes, method: str, number: int) -> Any:
    """Return the first value of an answer's result. Raises InstrumentRefused for the device's errors, else Garbled."""
    line = line.strip()
    try:
        reply = json.loads(line)
        if reply["id"] != number:
            raise Garbled(f"{who}: {line[:80]!r} answers another question than {number}")
        if "error" in reply:
            raise InstrumentRefused(f"{who}: {method}: {reply['error']}")
        error, *values = reply["result"]
    except (ValueError, KeyError, TypeError, RecursionError) as e:
        raise Garbled(f"{who}: {method} was answered {line[:80]!r}, expected a JSON-RPC result") from e
    if type(error) is not int or error != 0 or not values:
        raise InstrumentRefused(f"{who}: {method} gave the error {error!r} ({line[:80]!r})")
    return values[0]


def _open(name: str, entry: InstrumentEntry, _: Ask) -> Instrument:
    settings = settings_of(name, Ids3010Settings, entry)
    if entry.resource is None:
        raise SettingsError(f"{name}: resource is missing: its address, such as 192.168.1.1:9090")
    return Ids3010(name, Link(Address(entry.resource), open_tcp), settings, entry.model, entry.serial)


TRIALS = (
    Trial("In its web page, stop the measurement"),
    Trial("Set the other pass mode"),
    Trial("Cover the sensor head"),
    Trial("Unplug the network cable"),
)
DRIVER = Driver(("ids3010",), _open, TRIALS)
