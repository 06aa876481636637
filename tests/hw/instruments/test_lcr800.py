"""LCR-800 dialogues: connection, every setting used, every result message, every error, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange
from hw.instruments.lcr800 import Lcr800, Lcr800Settings
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "result_s": 0.05, "deadline_s": 2.0}


def echo(message: str) -> tuple[bytes, bytes]:
    return message.encode() + b"\n\r", message.encode() + b"\n"


SESSION = ((b"COMU?\n\r", b"COMU:ON..\n"), echo("COMU:OVER"))
SETTINGS = tuple(
    map(echo, ("MAIN:TRIG:MANU", "MAIN:MODE:CD", "MAIN:CIRC:SERI", "MAIN:FREQ 1.00000", "MAIN:VOLT 1.000"))
)
SPEED = (echo("MAIN:SPEE:SLOW"),)
BIAS = ((b"MAIN:INTB?\n\r", b"MAIN:INTB:OFF.\n"), (b"MAIN:EXTB?\n\r", b"MAIN:EXTB:OFF.\n"))
FREQUENCY = (b"MAIN:FREQ?\n\r", b"MAIN:FREQ 1.00000\n")
CHECKED = (FREQUENCY, (b"MAIN:MODE?\n\r", b"MAIN:MODE:CD\n"))
START = (*SESSION, *SETTINGS, *SPEED, *BIAS, *CHECKED)
GOOD = b"MAIN:PRIM  4.9900\nMAIN:SECO  .0145uF\n"


def star(reply: bytes) -> tuple[bytes, bytes]:
    return b"MAIN:STAR\n\r", reply


def lcr(link, **more):
    return Lcr800("lcr", link, Lcr800Settings(**{**FAST, **more}), "LCR-819")


def test_a_reading_is_c_and_d_at_1_khz():
    with dialogue(*START, star(GOOD), star(b"MAIN:PRIM  4.9902\nMAIN:SECO  .0145uF\n")) as link:
        reading = lcr(link).read()
    assert reading.value == pytest.approx(4.9901e-6, rel=1e-12)
    assert (reading.unit, reading.more) == ("F", {"D": 0.0145})


@pytest.mark.parametrize(
    ("primary", "unit", "farads"),
    [
        (b" 499.00", b"nF", 499e-9),
        (b" 49900.", b"pF", 49.9e-9),
        (b" 9.8500", b"uF", 9.85e-6),
        (b"9.8500", b"uF", 9.85e-6),
    ],
)
def test_units_come_with_the_second_line(primary, unit, farads):
    """The last one as the manual prints its examples, without the blank of the sign."""
    once = star(b"MAIN:PRIM " + primary + b"\nMAIN:SECO .0145" + unit + b"\n")
    with dialogue(*START, once, once) as link:
        assert lcr(link).read().value == pytest.approx(farads)


def test_a_meter_that_triggers_itself_is_stopped():
    """AUTO streams results: they stand before the echo."""
    stop = (b"MAIN:TRIG:MANU\n\r", GOOD + b"MAIN:TRIG:MANU\n")
    rest = (*SETTINGS[1:], *SPEED, *BIAS, *CHECKED)
    with dialogue(*SESSION, stop, *rest, star(GOOD), star(GOOD)) as link:
        assert lcr(link).read().value == pytest.approx(4.99e-6)


def test_a_meter_that_only_streams():
    with dialogue(*SESSION, (b"MAIN:TRIG:MANU\n\r", GOOD * 15)) as link:
        with pytest.raises(Garbled, match="only results"):
            lcr(link).read()
        link.drop()


def test_other_settings_and_a_new_session_after_the_voltage():
    settings = (
        echo("MAIN:TRIG:MANU"), echo("MAIN:MODE:CD"), echo("MAIN:CIRC:PARA"), echo("MAIN:FREQ 1.00000"),
        echo("MAIN:VOLT 0.500"), echo("COMU:OFF."), *SESSION, echo("MAIN:SPEE:MEDI"),
    )  # fmt: skip
    with dialogue(*SESSION, *settings, *CHECKED) as link:
        lcr(link, circuit="PARA", voltage_V=0.5, speed="MEDI", reopen_after_voltage=True, bias="allow").connect()


def test_giving_the_meter_back():
    with dialogue(echo("COMU:OFF.")) as link:
        lcr(link).finish()


@pytest.mark.parametrize("reply", [b"COMU:OFF.\n", b"MAHR GMBH\n", b"COMU:ON.\n"])
def test_a_handshake_that_fails(reply):
    with dialogue((b"COMU?\n\r", reply)) as link, pytest.raises(Garbled, match="is it an LCR-800"):
        lcr(link).read()


@pytest.mark.parametrize("n", range(5))
def test_no_setting_is_taken_for_granted(n):
    """A lost echo and a wrong one, of every setting."""
    message = SETTINGS[n][0]
    for reply, error in ((b"", NoReply), (b"MAIN:XXXX\n", InstrumentRefused)):
        with (
            dialogue(*SESSION, *SETTINGS[:n], (message, reply)) as link,
            pytest.raises(error, match=r"acknowledged|echo"),
        ):
            lcr(link).read()


@pytest.mark.parametrize("n", [0, 1])
def test_a_bias_that_is_on(n):
    on = (BIAS[n][0], BIAS[n][1].replace(b"OFF.", b"ON.."))
    with dialogue(*SESSION, *SETTINGS, *SPEED, *BIAS[:n], on) as link, pytest.raises(InstrumentRefused, match="poled"):
        lcr(link).read()


@pytest.mark.parametrize(
    ("answers", "error"),
    [
        (((b"MAIN:FREQ?\n\r", b"MAIN:FREQ 10.0000\n"),), Implausible),
        (((b"MAIN:FREQ?\n\r", b"MAIN:FREQ 1.0x000\n"),), Garbled),
        ((FREQUENCY, (b"MAIN:MODE?\n\r", b"MAIN:MODE:RQ\n")), Implausible),
    ],
)
def test_another_frequency_or_mode_is_never_measured(answers, error):
    with dialogue(*START[:-2], *answers) as link, pytest.raises(error):
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
        (b"MAIN:PRIM  4.9\xb000\nMAIN:SECO  .0145uF\n", Garbled, "no text"),
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
    steps = (*START, star(GOOD), star(GOOD.replace(b"4.99", b"4.89")))
    with dialogue(*steps) as link, pytest.raises(Implausible, match="two readings in a row"):
        lcr(link).read()


def test_the_reminder_of_the_bias():
    with dialogue() as link:
        assert "poled" in " ".join(lcr(link).reminders)
