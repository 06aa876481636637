"""LCR-800 dialogues: connection, every setting used, every result message, every error, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange
from hw.instruments.lcr800 import Lcr800, Lcr800Settings
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "result_s": 0.05, "deadline_s": 2.0}


def echo(message: str) -> tuple[bytes, bytes]:
    return message.encode() + b"\n\r", message.encode() + b"\n"


SESSION = ((b"COMU?\n\r", b"COMU:ON..\n"), echo("COMU:OVER"))
SET = tuple(
    f"MAIN:{words}"
    for words in (
        "TRIG:MANU",
        "DISP:VALU",
        "MODE:CD",
        "R.H.:OFF.",
        "CIRC:SERI",
        "SPEE:SLOW",
        "FREQ 1.00000",
        "VOLT 1.000",
    )
)
SETTINGS = tuple(map(echo, SET))


def told(*answers: str) -> tuple[tuple[bytes, bytes], ...]:
    """Each setting is asked and answered as it was set, or as `answers` say."""
    said = {words[5:9]: words for words in (*SET, "MAIN:INTB:OFF.", "MAIN:EXTB:OFF.", *answers)}
    return tuple((f"MAIN:{key}?\n\r".encode(), f"{words}\n".encode()) for key, words in said.items())


CHECKED = told()
AS_WANTED = told()[:8]
FOUND = (AS_WANTED[0], SETTINGS[0], *AS_WANTED[1:])  # before anything else is set: the meter is given back like that
OPENED = (*SESSION, *FOUND)
START = (*OPENED, *SETTINGS, *CHECKED)
GOOD = b"MAIN:PRIM  4.9900\nMAIN:SECO  .0145uF\n"


def star(reply: bytes) -> tuple[bytes, bytes]:
    return b"MAIN:STAR\n\r", reply


def lcr(link, **more):
    return Lcr800("lcr", link, Lcr800Settings(**{**FAST, **more}), "LCR-819")


def test_a_reading_is_c_and_d_at_1_khz():
    with dialogue(*START, star(GOOD), star(b"MAIN:PRIM  4.9902\nMAIN:SECO  .0147uF\n"), *CHECKED) as link:
        reading = lcr(link).read()
    assert reading.value == pytest.approx(4.9901e-6, rel=1e-12)
    assert (reading.unit, reading.more["D"]) == ("F", pytest.approx(0.0146))
    assert reading.settings == {
        "TRIG": "MANU", "DISP": "VALU", "MODE": "CD", "R.H.": "OFF", "CIRC": "SERI", "SPEE": "SLOW", "FREQ": "1.00000",
        "VOLT": "1.000", "INTB": "OFF", "EXTB": "OFF",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("primary", "unit", "farads"),
    [
        (b" 499.00", b"nF", 499e-9),
        (b" 4990.0", b"nF", 4.99e-6),
        (b" 9.8500", b"uF", 9.85e-6),
        (b"9.8500", b"uF", 9.85e-6),
    ],
)
def test_units_come_with_the_second_line(primary, unit, farads):
    """The last one as the manual prints its examples, without the blank of the sign."""
    once = star(b"MAIN:PRIM " + primary + b"\nMAIN:SECO .0145" + unit + b"\n")
    with dialogue(*START, once, once, *CHECKED) as link:
        assert lcr(link).read().value == pytest.approx(farads)


def test_a_meter_that_triggers_itself_is_stopped():
    """AUTO streams results: they stand before the answer and the echo, and it streams again when it is given back."""
    asked = (b"MAIN:TRIG?\n\r", GOOD + b"MAIN:TRIG:AUTO\n")
    stop = (b"MAIN:TRIG:MANU\n\r", GOOD + b"MAIN:TRIG:MANU\n")
    off = (b"COMU:OFF.\n\r", GOOD + b"COMU:OFF.\n")
    again = (echo("MAIN:TRIG:AUTO"), off)
    start = (*SESSION, asked, stop, *AS_WANTED[1:], *SETTINGS, *CHECKED)
    with dialogue(*start, star(GOOD), star(GOOD), *CHECKED, *again) as link:
        meter = lcr(link)
        assert meter.read().value == pytest.approx(4.99e-6)
        meter.close()


def test_a_meter_is_given_back_as_it_was_found():
    other = ("MAIN:DISP:DELT", "MAIN:MODE:RQ", "MAIN:R.H.:ON..", "MAIN:SPEE:FAST", "MAIN:FREQ 0.12000")
    found = told(*other)[:8]
    start = (*SESSION, found[0], SETTINGS[0], *found[1:], *SETTINGS, *CHECKED)
    back = [echo(words) for words in reversed(other)]
    with dialogue(*start, star(GOOD), star(GOOD), *CHECKED, *back, echo("COMU:OFF.")) as link:
        meter = lcr(link)
        meter.read()
        meter.close()


def test_a_meter_that_no_longer_answers_is_closed_all_the_same():
    with dialogue(*START, (b"COMU:OFF.\n\r", b"")) as link:
        meter = lcr(link)
        meter.connect()
        meter.close()
    assert "not set back as it was found" in str(link.take_transcript())


def test_a_meter_that_only_streams():
    with dialogue(*SESSION, (b"MAIN:TRIG?\n\r", GOOD * 25)) as link:
        with pytest.raises(Garbled, match="results came unasked"):
            lcr(link).read()
        link.drop()


def test_other_settings_and_a_new_session_after_the_voltage():
    words = ("MAIN:CIRC:PARA", "MAIN:SPEE:MEDI", "MAIN:VOLT 0.500")
    settings = [*SETTINGS[:4], *map(echo, words[:2]), SETTINGS[6], echo(words[2])]
    with dialogue(*OPENED, *settings, echo("COMU:OFF."), *SESSION, *told(*words)[:-2]) as link:
        lcr(link, circuit="PARA", voltage_V=0.5, speed="MEDI", reopen_after_voltage=True, bias="allow").connect()


def test_positive_numbers_with_a_blank_as_the_manual_prints_them():
    """Page 89: a positive output starts with a blank instead of its sign."""
    blank = ("MAIN:FREQ  1.00000", "MAIN:VOLT  1.000")
    settings = [*SETTINGS[:6], *((SETTINGS[6 + n][0], f"{words}\n".encode()) for n, words in enumerate(blank))]
    asked = told(*blank)
    with dialogue(*OPENED, *settings, *asked, star(GOOD), star(GOOD), *asked) as link:
        assert lcr(link).read().value == pytest.approx(4.99e-6)


@pytest.mark.parametrize("reply", [b"COMU:OFF.\n", b"MAHR GMBH\n", b"COMU:ON.\n"])
def test_a_handshake_that_fails(reply):
    with dialogue((b"COMU?\n\r", reply)) as link, pytest.raises(Garbled, match="is it an LCR-800"):
        lcr(link).read()


@pytest.mark.parametrize("n", range(8))
def test_no_setting_is_taken_for_granted(n):
    """A lost echo and a wrong one, of every setting."""
    message = SETTINGS[n][0]
    for reply, error in ((b"", NoReply), (b"MAIN:XXXX\n", InstrumentRefused)):
        with (
            dialogue(*OPENED, *SETTINGS[:n], (message, reply)) as link,
            pytest.raises(error, match=r"acknowledged|echo"),
        ):
            lcr(link).read()


@pytest.mark.parametrize("source", ["INTB", "EXTB"])
def test_a_bias_that_is_on_is_refused_before_anything_is_measured(source):
    asked = told(f"MAIN:{source}:ON..")[: 9 if source == "INTB" else 10]
    with dialogue(*OPENED, *SETTINGS, *asked) as link, pytest.raises(InstrumentRefused, match="poled"):
        lcr(link).read()


CHANGED = (
    "MAIN:TRIG:AUTO", "MAIN:DISP:DELT", "MAIN:DISP:DELP", "MAIN:MODE:RQ", "MAIN:R.H.:ON..", "MAIN:CIRC:PARA",
    "MAIN:SPEE:FAST", "MAIN:FREQ 10.0000", "MAIN:VOLT 0.005",
)  # fmt: skip


@pytest.mark.parametrize("changed", CHANGED)
@pytest.mark.parametrize("moment", ["before", "during", "at the end"])
def test_what_the_keys_change_is_never_measured(changed, moment):
    """Asked before a value, after it, and at the end of a run before anything is set."""
    until = [words[5:9] for words in SET].index(changed[5:9]) + 1
    other, values = told(changed)[:until], (star(GOOD), star(GOOD))
    steps = {
        "before": other,
        "during": (*CHECKED, *values, *other),
        "at the end": (*CHECKED, *values, *CHECKED, *other),
    }
    with dialogue(*OPENED, *SETTINGS, *steps[moment]) as link:
        meter = lcr(link)
        if moment == "at the end":
            meter.read()
        with pytest.raises(Implausible, match=f"MAIN:{changed[5:9]} is"):
            meter.confirm() if moment == "at the end" else meter.read()


@pytest.mark.parametrize("answer", ["MAIN:TRIG", "MAIN:TRIG?", "MAIN:FREQ:CD", ""])
def test_an_answer_to_another_question(answer):
    asked = (b"MAIN:TRIG?\n\r", f"{answer}\n".encode())
    with dialogue(*OPENED, *SETTINGS, asked) as link, pytest.raises(Garbled, match="expected MAIN:TRIG"):
        lcr(link).read()


@pytest.mark.parametrize(
    ("reply", "error", "words"),
    [
        (b"PRIM:OV01\n", OverRange, "OV01"),
        (b"PRIM:OVER\n", OverRange, "OVER"),
        (b"MAIN:PRIM  4.9900\nSECO:OVER uF\n", OverRange, "D is out of range"),
        (b"MAIN:PRIM  4.9900\nSECO:OVERuF\n", OverRange, "D is out of range"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .0045  \n", Garbled, "pF, nF or uF"),  # ohm: another mode
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .0045mH\n", Garbled, "pF, nF or uF"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .0045nFk \n", Garbled, "pF, nF or uF"),
        (b"MAIN:PRIM  4.990\nMAIN:SECO  .0145uF\n", Garbled, "5 digits"),
        (b"MAIN:PRIM   4.9900\nMAIN:SECO  .0145uF\n", Garbled, "7 characters"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO   .0145uF\n", Garbled, "6 characters"),
        (b"MAIN:PRIM  49.9000\nMAIN:SECO  .0145uF\n", Garbled, "5 digits"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .145uF\n", Garbled, "4 digits"),
        (b"MAIN:PRIM  51000.\nMAIN:SECO  .0145nF\n", Garbled, "expected MAIN:PRIM"),  # the point was lost
        (b"MAIN:PRIM  ------\nMAIN:SECO  .0145uF\n", OverRange, "over range"),
        (b"MAIN:PRIM  4,9900\nMAIN:SECO  .0145uF\n", Garbled, "decimal comma"),
        (b"MAIN:PRIM  4.9\xb000\nMAIN:SECO  .0145uF\n", Garbled, "not text"),
        (b"MAIN:SECO  .0145uF\nMAIN:PRIM  4.9900\n", Garbled, "expected MAIN:PRIM"),
        (b"MAIN:PRIM  499.00\nMAIN:SECO  .0145uF\n", Implausible, "outside 0.01 to 100"),
        (b"MAIN:PRIM -4.9900\nMAIN:SECO  .0145uF\n", Implausible, "outside 0.01 to 100"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .5145uF\n", Implausible, "D = 0.5145"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO -.0145uF\n", Implausible, "D = -0.0145"),
        (b"MAIN:PRIM  4.9900\n", NoReply, "no result within"),
        (b"MAIN:PRIM  4.9900\nMAIN:SECO  .0145u", NoReply, "no result within"),
        (b"", NoReply, "no result within"),
    ],
)  # fmt: skip
def test_errors_and_damage_are_no_reading(reply, error, words):
    with dialogue(*START, star(reply)) as link:
        with pytest.raises(error, match=words):
            lcr(link).read()
        link.drop()


def test_two_results_that_disagree():
    for second in (GOOD.replace(b"4.99", b"4.89"), GOOD.replace(b".0145", b".0195")):  # C, and D
        steps = (*START, star(GOOD), star(second))
        with dialogue(*steps) as link, pytest.raises(Implausible, match="readings in a row differ"):
            lcr(link).read()


def test_the_reminder_of_the_bias():
    with dialogue() as link:
        assert "poled" in " ".join(lcr(link).reminders)
