"""What an LCR-800 can be set to and asked beside a measurement: every command of its protocol, byte for byte."""

import pytest

from hw.errors import Garbled, InstrumentRefused, NoReply
from hw.instruments.lcr800_commands import CHOICES, NUMBERS, QUESTIONS, SWITCHES, setting
from hw.simulated import Lcr800Device
from tests.hw.instruments.dialogue import dialogue
from tests.hw.instruments.test_lcr800 import GOOD, SESSION, START, echo, lcr, star

# as the manual and the drivers print them
MESSAGES = {
    ("SPEE", "SLOW"): "MAIN:SPEE:SLOW",
    ("SPEE", "MEDI"): "MAIN:SPEE:MEDI",
    ("SPEE", "FAST"): "MAIN:SPEE:FAST",
    ("DISP", "VALU"): "MAIN:DISP:VALU",
    ("MODE", "RQ"): "MAIN:MODE:RQ",
    ("MODE", "CD"): "MAIN:MODE:CD",
    ("MODE", "CR"): "MAIN:MODE:CR",
    ("MODE", "LQ"): "MAIN:MODE:LQ",
    ("MODE", "LR"): "MAIN:MODE:LR",
    ("MODE", "ZQ"): "MAIN:MODE:ZQ",
    ("CIRC", "SERI"): "MAIN:CIRC:SERI",
    ("CIRC", "PARA"): "MAIN:CIRC:PARA",
    ("TRIG", "AUTO"): "MAIN:TRIG:AUTO",
    ("TRIG", "MANU"): "MAIN:TRIG:MANU",
    ("R.H.", True): "MAIN:R.H.:ON..",
    ("R.H.", False): "MAIN:R.H.:OFF.",
    ("C.V.", True): "MAIN:C.V.:ON..",
    ("C.V.", False): "MAIN:C.V.:OFF.",
    ("INTB", True): "MAIN:INTB:ON..",
    ("INTB", False): "MAIN:INTB:OFF.",
    ("EXTB", True): "MAIN:EXTB:ON..",
    ("EXTB", False): "MAIN:EXTB:OFF.",
    ("PPM.", True): "MAIN:PPM.:ON..",
    ("PPM.", False): "MAIN:PPM.:OFF.",
    ("FREQ", 1.0): "MAIN:FREQ 1.00000",
    ("FREQ", 0.012): "MAIN:FREQ 0.01200",
    ("FREQ", 100.0): "MAIN:FREQ 100.000",
    ("VOLT", 0.5): "MAIN:VOLT 0.500",
    ("AVER", 1.0): "STEP:AVER 1.00",
    ("AVER", 255.0): "STEP:AVER 255.",
    ("STOR", 100.0): "MEMO:STOR 100.",
    ("NOMV", 32.0): "SORT:NOMV +32.0000",
    ("NOMV", -1.5): "SORT:NOMV -1.50000",
}


@pytest.mark.parametrize(("function", "value"), MESSAGES)
def test_every_setting_is_sent_and_its_echo_awaited(function, value):
    message = MESSAGES[function, value]
    with dialogue(*SESSION, echo(message)) as link:
        lcr(link).set_to(function, value)


def test_all_functions_are_here():
    assert {f for f, _ in MESSAGES} == {*CHOICES, *SWITCHES, *NUMBERS}
    assert all((f, v) in MESSAGES for f, values in CHOICES.items() for v in values)


@pytest.mark.parametrize(
    ("function", "value", "words"),
    [
        ("FREQ", 300.0, "0.012 to 200 kHz"),
        ("FREQ", float("nan"), "0.012 to 200 kHz"),
        ("VOLT", 5.0, "0.005 to 1.275 V"),
        ("VOLT", True, "0.005 to 1.275 V"),
        ("AVER", 0.0, "1 to 255"),
        ("MODE", "CP", "RQ, CD"),
        ("INTB", "ON..", "True or False"),
        ("SPEE", 1.0, "SLOW, MEDI, FAST"),
        ("BIAS", True, "one of SPEE"),
    ],
)
def test_what_the_meter_does_not_have_is_never_sent(function, value, words):
    with dialogue() as link, pytest.raises(ValueError, match=f"{words}.*nothing sent"):
        lcr(link).set_to(function, value)


def test_a_setting_that_is_not_echoed_is_not_set():
    sent = setting("SPEE", "FAST").encode() + b"\n\r"
    with dialogue(*SESSION, (sent, b"MAIN:SPEE:SLOW\n")) as link, pytest.raises(InstrumentRefused, match="not set"):
        lcr(link).set_to("SPEE", "FAST")
    with dialogue(*SESSION, (sent, b"")) as link, pytest.raises(NoReply, match="not acknowledged"):
        lcr(link).set_to("SPEE", "FAST")


def test_after_a_setting_a_reading_sets_its_own_again():
    steps = (*SESSION, echo("MAIN:MODE:RQ"), *START, star(GOOD), star(GOOD))
    with dialogue(*steps) as link:
        meter = lcr(link)
        meter.set_to("MODE", "RQ")
        assert meter.read().value == pytest.approx(4.99e-6)


@pytest.mark.parametrize("function", QUESTIONS)
def test_every_question_of_the_simulated_meter(function):
    """Sent and read byte for byte; the answer is what the simulator's protocol gives."""
    device = Lcr800Device(lambda: 5e-6)
    device.feed(b"COMU?\n\rCOMU:OVER\n\r")
    question = QUESTIONS[function].encode() + b"?\n\r"
    (answer,) = device.feed(question)
    with dialogue(*SESSION, (question, answer)) as link:
        said = lcr(link).asked(function)
    assert answer.decode().strip() in (f"{QUESTIONS[function]}:{said}", f"{QUESTIONS[function]} {said}")


@pytest.mark.parametrize("message", MESSAGES.values())
def test_the_simulated_meter_echoes_and_keeps_every_setting(message):
    device = Lcr800Device(lambda: 5e-6)
    device.feed(b"COMU?\n\rCOMU:OVER\n\r")
    assert device.feed(message.encode() + b"\n\r") == [message.encode() + b"\n"]
    if not message.startswith("MEMO"):
        assert device.feed(message[:9].encode() + b"?\n\r") == [message.encode() + b"\n"]


def test_questions_that_go_wrong():
    with dialogue() as link, pytest.raises(ValueError, match="'STOR': expected one of"):
        lcr(link).asked("STOR")
    for reply in (b"MAIN:SPEED\n", b"MAIN:CIRC:SERI\n", b"MAIN:SPEE\n"):
        with dialogue(*SESSION, (b"MAIN:SPEE?\n\r", reply)) as link, pytest.raises(Garbled, match="SPEE"):
            lcr(link).asked("SPEE")


@pytest.mark.parametrize("which", ["OPEN", "SHOR"])
def test_zeroing(which):
    sent = f"OFFS:{which}\n\r".encode()
    with dialogue(*SESSION, (sent, f"{which}:OK\n".encode())) as link:
        lcr(link).zero(which)
    with (
        dialogue(*SESSION, (sent, f"{which}:FAIL\n".encode())) as link,
        pytest.raises(InstrumentRefused, match="not zeroed"),
    ):
        lcr(link).zero(which)
    with dialogue(*SESSION, (sent, b"")) as link, pytest.raises(NoReply, match="not acknowledged"):
        lcr(link, zeroing_s=0.05).zero(which)


def test_zeroing_neither_open_nor_short():
    with dialogue() as link, pytest.raises(ValueError, match="OPEN, SHOR; nothing sent"):
        lcr(link).zero("LOAD")
