"""Drivers of others: a value of a class of pymeasure, with what is expected before and after it; dialogues by the
package's own adapter for tests."""

import contextlib
from collections.abc import Iterator

import pytest

from hw.errors import Garbled, Implausible, InstrumentError, InstrumentRefused, SettingsError, WrongInstrument
from hw.instruments import open_instrument
from hw.instruments.pymeasure_driver import Pymeasure, PymeasureSettings
from specs.bench import InstrumentEntry

pytest.importorskip("pymeasure")
from pymeasure.adapters import ProtocolAdapter
from pymeasure.instruments.agilent import AgilentE4980

SETTINGS = {
    "class": "pymeasure.instruments.agilent.AgilentE4980",
    "value": "impedance[0]",
    "unit": "uF",
    "expect": {"frequency": 1000.0, "mode": "CSD"},
    "range": [0.01, 100.0],
    "agreement": 0.01,
}
FREQ, MODE, NO_ERROR = (":FREQ:CW?", "1.0E+03"), ("FUNCtion:IMPedance:TYPE?", "CSD"), ("SYST:ERR?", '0,"No error"')
IDN = ("*IDN?", "Agilent Technologies,E4980A,MY46412345,A.06.13")


def fetched(value: float) -> tuple[str, str]:
    return ":FETCH?", f"{value:.6E},0.0145,+0"


@contextlib.contextmanager
def meter(*pairs: tuple[str, str], serial: str | None = None, **change: object) -> Iterator[Pymeasure]:
    """An instrument in whose dialogue every pair is said, and nothing else."""
    settings = PymeasureSettings.model_validate(SETTINGS | change)
    adapter = ProtocolAdapter([("FORM ASC", None), *pairs])  # the class sets it when it is opened
    yield Pymeasure("lcr", settings, lambda: AgilentE4980(adapter), "E4980A", serial)
    assert adapter._index == len(pairs) + 1, pairs[adapter._index - 1 :]


def test_a_value_stands_between_two_looks_at_what_is_expected() -> None:
    said = (FREQ, MODE, fetched(5.1), fetched(5.102), NO_ERROR, FREQ, MODE)
    with meter(*said) as lcr:
        reading = lcr.read()
    assert (reading.value, reading.unit) == (pytest.approx(5.101e-6, rel=1e-12), "F")
    assert reading.raw[0].startswith(b"[5.1")
    assert lcr.asked == {"frequency": "1000.0", "mode": "CSD"}


def test_it_says_who_it_is() -> None:
    with meter(IDN, NO_ERROR, FREQ, MODE) as lcr:
        assert lcr.connect().serial == "MY46412345"
        assert lcr.asked["mode"] == "CSD"
    with meter(IDN, serial="MY1") as lcr, pytest.raises(WrongInstrument, match="swapped"):
        lcr.connect()


REFUSED = {
    "another frequency": (((":FREQ:CW?", "1.2E+02"),), Implausible, "frequency is 120.0, expected 1000.0"),
    "not a number": (((":FREQ:CW?", "nan"),), Implausible, "frequency is nan"),
    "another function": ((FREQ, ("FUNCtion:IMPedance:TYPE?", "CPD")), Implausible, "mode is 'CPD'"),
    "changed meanwhile": (
        (FREQ, MODE, fetched(5.1), fetched(5.1), NO_ERROR, (":FREQ:CW?", "1.2E+02")),
        Implausible,
        "frequency is 120.0",
    ),
    "moving": ((FREQ, MODE, fetched(5.1), fetched(5.2), NO_ERROR, FREQ, MODE), Implausible, "differ"),
    "over range": ((FREQ, MODE, (":FETCH?", "9.9E+37,9.9E+37,+1")), Implausible, "outside"),
    "an error": (
        (FREQ, MODE, fetched(5.1), fetched(5.1), ("SYST:ERR?", '-211,"Trigger ignored"'), NO_ERROR),
        InstrumentRefused,
        "Trigger ignored",
    ),
    "garbage": ((FREQ, MODE, (":FETCH?", "what?")), Garbled, "expected a number|has no"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_no_value_without_what_is_expected(case: str) -> None:
    said, error, words = REFUSED[case]
    with meter(*said) as lcr, pytest.raises(error, match=words):
        lcr.read()


def test_what_a_class_raises_is_one_line_of_ours() -> None:
    settings = PymeasureSettings.model_validate(SETTINGS)

    def fails() -> None:
        raise ZeroDivisionError("their bug\nin two lines")

    with pytest.raises(InstrumentError, match="opening: ZeroDivisionError: their bug in two lines"):
        Pymeasure("lcr", settings, fails).read()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"class": "os.system"}, r"expected pymeasure\.instruments"),
        ({"class": "pymeasure.instruments.agilent.Nothing"}, "has no pymeasure.instruments.agilent.Nothing"),
        ({"value": "__class__"}, "expected an attribute"),
        ({"value": "impedance[0]; reset"}, "expected an attribute"),
        ({"expect": {"_adapter.x": 1.0}}, "expected an attribute"),
        ({"expect": {}}, "expect"),
        ({"unit": "furlong"}, "expected a unit of"),
        ({"range": [1.0, 0.0]}, "two rising values"),
    ],
)
def test_an_entry_that_cannot_be(change: dict[str, object], words: str) -> None:
    entry = InstrumentEntry(driver="pymeasure", measures=[], settings=SETTINGS | change, resource="GPIB::17")
    with pytest.raises(SettingsError, match=words):
        open_instrument("lcr", entry, input).connect()


def test_without_a_resource_it_says_what_is_missing() -> None:
    with pytest.raises(SettingsError, match="resource is missing"):
        open_instrument("lcr", InstrumentEntry(driver="pymeasure", measures=[], settings=SETTINGS), input)
