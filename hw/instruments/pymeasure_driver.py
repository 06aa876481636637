"""Instruments by the drivers of the package pymeasure: one value of one class, and what its settings must be.

Known from the documentation of pymeasure: an instrument is made from a VISA name; its settings and values are
attributes, which ask the instrument when they are read; `id` is its answer to `*IDN?`; `check_errors` empties the queue
of errors. Nothing is known of the class itself: whether an attribute means what its name suggests, and which settings
it makes when it is opened, shows in the commissioning only. Only classes of `pymeasure.instruments` are loaded."""

import re
import time
import warnings
from collections.abc import Callable, Mapping
from functools import reduce
from importlib import import_module
from typing import Annotated, Any

from pydantic import Field

from hw.errors import Garbled, Implausible, InstrumentError, InstrumentRefused, NoReply, SettingsError
from hw.instruments.driver import Ask, Driver, Instrument, Trial, settings_of
from hw.instruments.reading import Identity, Reading, agreed, check_identity, check_unchanged
from hw.link import Link
from specs.bench import InstrumentEntry
from specs.distribution import install
from specs.strict import Finite, Positive, Strict, Words
from specs.units import UnitMismatch, factor

LIBRARY = "pymeasure.instruments."
CLASS = re.compile(r"pymeasure\.instruments(\.[A-Za-z]\w*)+\.[A-Z]\w*")
PATH = re.compile(r"[A-Za-z]\w*(\.[A-Za-z]\w*)*")  # no underscore at the beginning: private names stay private
VALUE = re.compile(rf"(?P<path>{PATH.pattern})(\[(?P<index>\d+)\])?")
SI = ("m", "F", "V", "ohm", "N", "Hz", "s", "rad")
READINGS, WITHIN = 2, 1e-6  # of one value; relative difference of a number that is expected
Plain = bool | float | str


class PymeasureSettings(Strict):
    """class: its full name; value: attribute, such as `impedance[0]`, in `unit`; expect: attribute -> value required
    around each reading. range: plausible values; agreement: largest difference of two answers, both in `unit`."""

    class_: Annotated[str, Field(alias="class")]
    value: Words
    unit: Words
    expect: Annotated[dict[Words, Plain], Field(min_length=1)]
    range: Annotated[list[Finite], Field(min_length=2, max_length=2)]
    agreement: Positive
    timeout_s: Positive | None = None


class Pymeasure:
    """An instrument behind a class of pymeasure. make: returns the class's object, which then is open."""

    link: Link | None = None

    def __init__(
        self,
        name: str,
        settings: PymeasureSettings,
        make: Callable[[], Any],
        model: str | None = None,
        serial: str | None = None,
    ) -> None:
        """Raise SettingsError for an invalid value or unit."""
        self.name, self.settings, self.model, self.serial, self._make = name, settings, model, serial, make
        for path in settings.expect:
            if not PATH.fullmatch(path):
                raise SettingsError(f"{name}: expect.{path}: expected an attribute of {settings.class_}")
        found = VALUE.fullmatch(settings.value)
        if not found:
            raise SettingsError(f"{name}: value = {settings.value!r}: expected an attribute, such as impedance[0]")
        self._path, self._index = found["path"], found["index"]
        self.unit, self._scale = _si(name, settings.unit)
        if not settings.range[0] < settings.range[1]:
            raise SettingsError(f"{name}: range = {settings.range}: expected two rising values")
        words = f"read by {settings.class_}, which was not written here: compare its display with what is read"
        self.reminders: tuple[str, ...] = (words,)
        self.asked: Mapping[str, str] = {}
        self._open: Any = None

    def connect(self) -> Identity:
        """Return the identity that `*IDN?` gives, if the class knows it. Raises InstrumentError."""
        device = self._device()
        identification = self._guard("id", lambda: device.id) if hasattr(type(device), "id") else None
        parts = [part.strip() for part in identification.split(",")] if isinstance(identification, str) else []
        identity = Identity(*parts[1:4]) if len(parts) == 4 else Identity(identification=identification)
        check_identity(self.name, identity, self.model, self.serial)
        self._errors()
        self.asked = self._expected()
        return identity

    def read(self) -> Reading:
        """Return the mean of two answers; expected settings are checked before and after. Raises InstrumentError."""
        before = self._expected()
        first, second = (self._answer() for _ in range(READINGS))
        self._errors()
        after = self._expected()
        check_unchanged(self.name, before, after)
        self.asked = after
        return agreed(self.name, [first, second], self.settings.agreement * self._scale)

    def confirm(self) -> Identity:
        """Return the identity once more. Raises WrongInstrument, Implausible if its settings have changed."""
        before = self.asked
        identity = self.connect()
        check_unchanged(self.name, before, self.asked)
        return identity

    def close(self) -> None:
        device, self._open = self._open, None
        if device is not None:
            self._guard("close", lambda: device.adapter.close())

    def _device(self) -> Any:
        if self._open is None:
            self._open = self._guard("opening", self._make)
        return self._open

    def _answer(self) -> Reading:
        raw = self._get(self._path)
        given = raw
        if self._index is not None:
            try:
                given = raw[int(self._index)]
            except (TypeError, IndexError, KeyError) as e:
                raise Garbled(f"{self.name}: {self._path} is {raw!r}: it has no [{self._index}]") from e
        try:
            value = float(given)
        except (TypeError, ValueError) as e:
            raise Garbled(f"{self.name}: {self.settings.value} is {given!r}, expected a number") from e
        lo, hi = self.settings.range
        if not lo <= value <= hi:
            unit = self.settings.unit
            raise Implausible(
                f"{self.name}: {value:g} {unit} is outside {lo:g} to {hi:g} {unit}, the range in the file"
            )
        return Reading(value * self._scale, self.unit, time.time(), (repr(raw).encode(),), settings=dict(self.asked))

    def _expected(self) -> dict[str, str]:
        """Return the instrument's settings. Raises Implausible if one differs from the bench file."""
        stated = {}
        for path, wanted in self.settings.expect.items():
            found = self._get(path)
            if not _is_as_expected(found, wanted):
                words = f"{path} is {found!r}, expected {wanted!r}"
                raise Implausible(f"{self.name}: {words}; set it at the instrument, or change `expect`")
            stated[path] = str(found)
        return stated

    def _errors(self) -> None:
        device = self._device()
        if hasattr(type(device), "next_error"):
            errors = self._guard("check_errors", device.check_errors)
            if errors:
                raise InstrumentRefused(f"{self.name}: its queue holds errors: {errors[:3]}")

    def _get(self, path: str) -> Any:
        return self._guard(path, lambda: reduce(getattr, path.split("."), self._device()))

    def _guard(self, what: str, action: Callable[[], Any]) -> Any:
        """Return the result of the library's code. Raises InstrumentError for every exception."""
        try:
            with warnings.catch_warnings(action="ignore"):  # of the library, to its own programmers
                return action()
        except InstrumentError:
            raise
        except TimeoutError as e:
            raise NoReply(f"{self.name}: {what}: nothing came in time") from e
        except Exception as e:
            words = " ".join(f"{type(e).__name__}: {e}".split())
            kind = NoReply if "VI_ERROR_TMO" in words else Garbled if isinstance(e, ValueError) else InstrumentRefused
            raise kind(f"{self.name}: {self.settings.class_}: {what}: {words}") from e


def _is_as_expected(found: Any, wanted: Plain) -> bool:
    """Return whether a setting agrees with the bench file, a number within a millionth."""
    if isinstance(wanted, bool | str):
        return str(found) == str(wanted) if isinstance(wanted, str) else found in (wanted, int(wanted))
    try:
        return abs(float(found) - wanted) <= WITHIN * abs(wanted)  # NaN is never what was expected
    except (TypeError, ValueError):
        return False


def _si(name: str, unit: str) -> tuple[str, float]:
    for base in SI:
        try:
            return base, factor(unit, base)
        except UnitMismatch:
            continue
    raise SettingsError(f"{name}: unit = {unit!r}: expected a unit of {', '.join(SI)}")


def _make(name: str, settings: PymeasureSettings, resource: str) -> Any:
    """Return the object of the class. Raises SettingsError if there is no such class."""
    module, _, kind = settings.class_.rpartition(".")
    try:
        import_module("pymeasure")
    except ImportError as e:
        raise SettingsError(f"{name}: the driver needs the package pymeasure: {install('pymeasure')}") from e
    try:
        found = getattr(import_module(module), kind)
    except (ImportError, AttributeError) as e:
        raise SettingsError(f"{name}: pymeasure has no {settings.class_} ({e})") from e
    more = {} if settings.timeout_s is None else {"timeout": 1000.0 * settings.timeout_s}
    return found(resource, **more)


def _open_instrument(name: str, entry: InstrumentEntry, _: Ask) -> Instrument:
    settings = settings_of(name, PymeasureSettings, entry)
    if not CLASS.fullmatch(settings.class_):
        raise SettingsError(f"{name}: class = {settings.class_!r}: expected {LIBRARY}MAKER.CLASS")
    if entry.resource is None:
        raise SettingsError(
            f"{name}: resource is missing: the instrument's VISA name, such as TCPIP::192.168.1.7::INSTR"
        )
    resource = entry.resource
    return Pymeasure(name, settings, lambda: _make(name, settings, resource), entry.model, entry.serial)


TRIALS = (
    Trial("Change a setting that `expect` names at the panel"),
    Trial("Change a setting at the panel that `expect` does not name, such as the display", asked=False),
)
DRIVER = Driver(("pymeasure",), _open_instrument, TRIALS)
