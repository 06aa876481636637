"""ND 287 and ND 281B dialogues: value, control bytes, ESC commands and every error, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange, WrongInstrument
from hw.instruments.heidenhain import FUNCTIONS, KEYS, TEXTS, Heidenhain, HeidenhainSettings
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "deadline_s": 2.0}
WHO = (b"\x1bA0000\r", b"\x02ND 287    \r\n349797-01 \r\nID 0001   \r\n")


def probe(link, **more):
    settings = {"range_mm": [-13.0, 13.0], **FAST, **more}
    return Heidenhain("probe", link, HeidenhainSettings(**settings), "ND 287", "77")


def value(reply: bytes) -> tuple[bytes, bytes]:
    return b"\x02", reply


MANUAL = b"-      5.23  =A\r\n"  # as the manual prints it


def test_the_example_of_the_manual():
    with dialogue(WHO, value(MANUAL), value(MANUAL)) as link:
        reading = probe(link).read()
    assert reading.value == pytest.approx(-5.23e-3)
    assert reading.raw == (MANUAL[:-2], MANUAL[:-2])


@pytest.mark.parametrize(
    ("line", "metres"),
    [
        (b"+    0.0035  =A", 3.5e-6),
        (b"+   12.9999  >A", 12.9999e-3),
        (b'-    0.0100 "<A', -254e-6),
        (b"     0.0035  =A", 3.5e-6),
    ],
)
def test_values(line, metres):
    with dialogue(WHO, value(line + b"\r\n"), value(line + b"\r\n")) as link:
        assert probe(link).read().value == pytest.approx(metres)


def test_blank_lines_that_the_readout_adds():
    blank = value(MANUAL + b"\r\n\r\n")
    with dialogue(WHO, blank, blank, unread=b"") as link:
        assert probe(link).read().value == pytest.approx(-5.23e-3)
        link.drop()


@pytest.mark.parametrize(
    ("reply", "error", "words"),
    [
        (b"+    0.0035 ?=A\r\n", OverRange, "fault"),
        (b"+    0.0035 G=A\r\n", Implausible, "unit 'G'"),
        (b"+    0.0035  =S\r\n", Implausible, "not the actual value"),
        (b"+    0.0035  =G\r\n", Implausible, "not the actual value"),
        (b"+    0.0035  =D\r\n", Implausible, "not the actual value"),
        (b"+   99.0035  =A\r\n", Implausible, "outside -13 to 13 mm"),
        (b"+   0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+     0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+     00035  =A\r\n", Garbled, "15 characters"),
        (b"+    0.0035 =A\r\n", Garbled, "15 characters"),
        (b"     0.0035   A\r\n", None, ""),
        (b"+  0 0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+    0.00\xb35  =A\r\n", Garbled, "no text"),
        (b"+    0.0035  =A", NoReply, "only"),
        (b"", NoReply, "no value"),
        (b"\x15", NoReply, "only"),
    ],
)
def test_errors_and_damage_are_no_reading(reply, error, words):
    if error is None:  # no sorting: as a readout without limits may send
        with dialogue(WHO, value(reply), value(reply)) as link:
            assert probe(link).read().value == pytest.approx(3.5e-6)
        return
    with dialogue(WHO, value(reply)) as link, pytest.raises(error, match=words):
        probe(link).read()


def test_two_values_that_disagree():
    steps = (WHO, value(b"+    0.0035  =A\r\n"), value(b"+    0.0935  =A\r\n"))
    with dialogue(*steps) as link, pytest.raises(Implausible, match="two readings in a row"):
        probe(link).read()


def test_another_identification():
    with dialogue(WHO) as link, pytest.raises(WrongInstrument, match="swapped"):
        probe(link, identification="ND 281").read()


@pytest.mark.parametrize(
    ("reply", "error"),
    [
        (b"\x15", InstrumentRefused),
        (b"ERR1\r\n", Garbled),
        (b"\x02ND 287\r\nx\r\ny\r\n", Garbled),
        (b"\x02ND 287    \r\n349797-01 \r\n", NoReply),
        (b"", NoReply),
        (b"\x02ND\x80287    \r\n349797-01 \r\nID 0001   \r\n", Garbled),
    ],
)
def test_an_identification_that_fails(reply, error):
    with dialogue((b"\x1bA0000\r", reply)) as link:
        with pytest.raises(error):
            probe(link).read()
        link.drop()


@pytest.mark.parametrize("function", [*FUNCTIONS, *KEYS])
def test_functions_and_keys(function):
    code = {**FUNCTIONS, **KEYS}[function]
    sent = b"\x1b" + code.encode() + b"\r"
    with dialogue((sent, b"\x06")) as link:
        probe(link).do(function)
    with dialogue((sent, b"\x15")) as link, pytest.raises(InstrumentRefused, match="not possible"):
        probe(link).do(function)
    with dialogue((sent, b"?")) as link, pytest.raises(Garbled):
        probe(link).do(function)
    with dialogue((sent, b"")) as link, pytest.raises(NoReply):
        probe(link).do(function)


@pytest.mark.parametrize("what", TEXTS)
def test_texts(what):
    with dialogue((b"\x1b" + TEXTS[what].encode() + b"\r", b"\x02+000000035\r\n")) as link:
        assert probe(link).text(what) == "+000000035"


def test_asking_what_is_wrong():
    with dialogue((b"\x05", b"SIGNAL TOO SMALL\r\n")) as link:
        assert probe(link).error_message() == "SIGNAL TOO SMALL"


def test_holding_the_output_and_going_on():
    with dialogue((b"\x13", b""), (b"\x11", b"")) as link:
        readout = probe(link)
        readout.hold()
        readout.go_on()
