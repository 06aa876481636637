"""ND 287 and ND 281B dialogues: value, control bytes, ESC commands and every error, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, NoReply, OverRange, WrongInstrument
from hw.instruments.heidenhain import Heidenhain, Nd287Settings
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "deadline_s": 2.0}
WHO = (b"\x1bA0000\r", b"\x02ND-287    \r\n349797-01 \r\nID 0001   \r\n")


def probe(link, **more):
    settings = {"range_mm": [-13.0, 13.0], "axis": "single", "resolution_um": 20.0, **FAST, **more}
    return Heidenhain("probe", link, Nd287Settings(**settings), "ND 287", "77")


def value(reply: bytes) -> tuple[bytes, bytes]:
    return b"\x02", reply


MANUAL = b"-      5.23  =A\r\n"  # as the manual prints it


def test_the_example_of_the_manual():
    with dialogue(WHO, value(MANUAL), value(MANUAL), WHO) as link:
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
    with dialogue(WHO, value(line + b"\r\n"), value(line + b"\r\n"), WHO) as link:
        assert probe(link).read().value == pytest.approx(metres)


def test_blank_lines_that_the_readout_adds():
    blank = value(MANUAL + b"\r\n\r\n")
    with dialogue(WHO, blank, blank, WHO, unread=b"") as link:
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
        (b"+    0.0035  =1\r\n", Implausible, "not the actual value"),
        (b"+    0.0035  =F\r\n", Implausible, "not the actual value"),
        (b"+       0.1  =A\r\n", Implausible, "steps of 100 um"),
        (b"+    0,0035  =A\r\n", Garbled, "decimal comma"),
        (b"----------- ==A\r\n", OverRange, "over range"),
        (b"\x13+   0.0035  =A\r\n", Garbled, "XON or XOFF"),
        (b"+   99.0035  =A\r\n", Implausible, "outside -13 to 13 mm"),
        (b"+   0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+     0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+     00035  =A\r\n", Garbled, "15 characters"),
        (b"+    0.0035 =A\r\n", Garbled, "15 characters"),
        (b"     0.0035   A\r\n", None, ""),
        (b"+  0 0.0035  =A\r\n", Garbled, "15 characters"),
        (b"+    0.00\xb35  =A\r\n", Garbled, "not text"),
        (b"+    0.0035  =A", NoReply, "only"),
        (b"", NoReply, "no value"),
        (b"\x15", NoReply, "only"),
    ],
)
def test_errors_and_damage_are_no_reading(reply, error, words):
    if error is None:  # no sorting: as a readout without limits may send
        with dialogue(WHO, value(reply), value(reply), WHO) as link:
            assert probe(link).read().value == pytest.approx(3.5e-6)
        return
    with dialogue(WHO, value(reply)) as link, pytest.raises(error, match=words):
        probe(link).read()


def test_two_values_that_disagree():
    steps = (WHO, value(b"+    0.0035  =A\r\n"), value(b"+    0.0935  =A\r\n"))
    with dialogue(*steps) as link, pytest.raises(Implausible, match="readings in a row differ"):
        probe(link).read()


def test_another_identification():
    with dialogue(WHO) as link, pytest.raises(WrongInstrument, match="swapped"):
        probe(link, identification="ND 281").read()


@pytest.mark.parametrize(
    ("reply", "error"),
    [
        (b"ERR1\r\n", Garbled),
        (b"\x02ND 287\r\nx\r\ny\r\n", Garbled),
        (b"\x02ND-287    \r\n349797-01 \r\n", NoReply),
        (b"", NoReply),
        (b"\x02ND\x80287    \r\n349797-01 \r\nID 0001   \r\n", Garbled),
    ],
)
def test_an_identification_that_fails(reply, error):
    with dialogue((b"\x1bA0000\r", reply)) as link:
        with pytest.raises(error):
            probe(link).read()
        link.drop()


def test_the_resolution_that_a_reading_needs_is_asked_of_the_display():
    coarse = value(MANUAL)
    with dialogue(WHO, coarse) as link, pytest.raises(Implausible, match="steps of 10 um, the bench file allows 1 um"):
        probe(link, resolution_um=1.0).read()


@pytest.mark.parametrize(("axis", "series"), [("X1", b"1"), ("X2", b"2")])
def test_an_axis_of_two_is_not_their_sum(axis, series):
    one, total = (value(b"+    0.0035  =" + s + b"\r\n") for s in (series, b"A"))
    with dialogue(WHO, one, one, WHO) as link:
        assert probe(link, axis=axis).read().settings["series"] == series.decode()
    with dialogue(WHO, total) as link, pytest.raises(Implausible, match=f"axis = '{axis}'"):
        probe(link, axis=axis).read()


def test_which_axis_is_displayed_must_be_said():
    with pytest.raises(ValueError, match="axis"):
        Nd287Settings(range_mm=[-1.0, 1.0])


@pytest.mark.parametrize("words", ["ND-287", "ND 287", "nd287"])
def test_an_identification_counts_without_blanks_and_hyphens(words):
    """Page 108 prints the hyphen; a bench file may leave it out."""
    with dialogue(WHO) as link:
        probe(link, identification=words).connect()


def test_a_readout_that_refuses_its_identification():
    """It can be used where the bench file asks for none, and not otherwise."""
    refused = (WHO[0], b"\x15")
    with dialogue(refused, value(MANUAL), value(MANUAL), refused) as link:
        assert probe(link).read().settings["identification"] == "not told"
    with dialogue(refused) as link, pytest.raises(WrongInstrument, match="refuses"):
        probe(link, identification="ND-287").read()


def test_another_readout_within_a_run():
    other = (WHO[0], WHO[1].replace(b"349797-01", b"344996-02"))
    with dialogue(WHO, value(MANUAL), value(MANUAL), other) as link, pytest.raises(Implausible, match="identification"):
        probe(link).read()
