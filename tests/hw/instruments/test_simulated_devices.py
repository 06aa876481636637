"""The simulated instruments against the published description: bytes in, bytes out, without any driver in between."""

import pytest

from hw.link import Deadline, Link
from hw.serial_port import LineSettings
from hw.simulated import FaultKind, HeidenhainDevice, Lcr800Device, LineFault, M1240Device, OptorsDevice, Server
from hw.simulated.lcr800 import _scaled
from hw.simulated.server import damaged


def said(device, message: bytes) -> bytes:
    return b"".join(device.feed(message))


@pytest.mark.parametrize(
    ("sent", "reply"),
    [
        (b"?\r", b"-0.3650mm\r\n"),
        (b"ID?\r", b"MAHR GMBH,C1216 \r\n"),
        (b"VER?\r", b"1.02 \r\n"),
        (b"UNI?\r", b"mm \r\n"),
        (b"SER?\r", b"1234/56\r\n"),
        (b"CHA?\r", b"-C1-C2\r\n"),
        (b"um\r", b"OK\r\n"),
        (b"um\r?\r", b"OK\r\n-365.0um\r\n"),
        (b"in\rUNI?\r", b"OK\r\nin \r\n"),
        (b"CHA+1\rCHA?\r", b"OK\r\n+C1\r\n"),
        (b"DIS APA-03\r", b"OK\r\n"),
        (b"DIS too long a text\r", b"ERR1\r\n"),
        (b"CHA+3\r", b"ERR1\r\n"),
        (b"xyz\r", b"ERR1\r\n"),
        (b"?", b""),
    ],
)
def test_optorsd(sent, reply):
    assert said(OptorsDevice(lambda: -0.365e-3), sent) == reply


def test_optorss_answers_one_question():
    device = OptorsDevice(lambda: 0.001e-3, duplex=False)
    assert said(device, b"ID?\r?\r") == b"0.0010mm\r\n"


def test_a_message_in_pieces():
    device = OptorsDevice(lambda: 0.0)
    assert [said(device, bytes([b])) for b in b"ID?\r"] == [b"", b"", b"", b"MAHR GMBH,C1216 \r\n"]


def test_the_switches_of_a_millimar():
    device = OptorsDevice(lambda: 25.4e-3)
    device.other_unit = True
    assert said(device, b"?\rUNI?\r") == b"1.00000in\r\nin \r\n"
    device.overrange = True
    assert said(device, b"?\r") == b"ERR3\r\n"
    device.silent = True
    assert said(device, b"?\r") == b""
    assert said(OptorsDevice(lambda: None), b"?\r") == b"ERR5\r\n"


@pytest.mark.parametrize(
    ("sent", "reply"),
    [
        (b"I\r", b"I,MAHRGMBH,C1216,V1.02\r"),
        (b"F1\r", b"F1\r"),
        (b"F2\r", b"F2\r"),
        (b"F3\r", b"F3\r"),
        (b"R\r", b"R\r"),
        (b"P86,2\r", b"\r"),
        (b"M\r", b"M1, -0.3650\r"),
        (b"P86,3\rM\r", b"\rM1, -365.0\r"),
        (b"Z\rM\r", b"Z\r"),
        (b"M70\rM70\r", b"00001, -0.365\r00001, 1.000\r"),
        (b"Q\r", b"ERR1\r"),
    ],
)
def test_m1240(sent, reply):
    assert said(M1240Device(lambda: -0.365e-3, stored=(-0.365e-3, 1e-3)), sent) == reply


def test_a_master_measurement_is_ended_by_a_key():
    device = M1240Device(lambda: 0.0)
    assert said(device, b"Z\rM\r") == b"Z\r"
    device.press_key()
    assert said(device, b"M\r") == b"M1, 0.0000\r"


def online(**more) -> Lcr800Device:
    device = Lcr800Device(lambda: 4.99e-6, clock=lambda: 0.0, **more)
    assert said(device, b"COMU?\n\rCOMU:OVER\n\r") == b"COMU:ON..\nCOMU:OVER\n"
    return device


@pytest.mark.parametrize("end", [b"\n", b"\n\r", b"\r\n"])
def test_lcr_takes_every_end(end):
    assert said(online(), b"MAIN:SPEE:FAST" + end) == b"MAIN:SPEE:FAST\n"


@pytest.mark.parametrize(
    ("sent", "reply"),
    [
        (b"MAIN:MODE:CD\n\rMAIN:STAR\n\r", b"MAIN:MODE:CD\nMAIN:PRIM  4.9900\nMAIN:SECO  .0145uF\n"),
        (b"MAIN:STAR\n\r", b"MAIN:PRIM  32.705\nMAIN:SECO  .0045  \n"),  # as switched on: R and Q
        (b"MAIN:FREQ?\n\r", b"MAIN:FREQ 1.00000\n"),
        (b"MAIN:VOLT 0.500\n\rMAIN:VOLT?\n\r", b"MAIN:VOLT 0.500\nMAIN:VOLT 0.500\n"),
        (b"MAIN:INTB?\n\r", b"MAIN:INTB:OFF.\n"),
        (b"MAIN:R.H.:ON..\n\r", b"MAIN:R.H.:ON..\n"),
        (b"MAIN:BIAS?\n\r", b"MAIN:BIAS:OFF.\n"),
        (b"OFFS:OPEN\n\r", b"OPEN:OK\n"),
        (b"OFFS:SHOR\n\r", b"SHOR:OK\n"),
        (b"STEP:AVER 1.00\n\r", b"STEP:AVER 1.00\n"),
        (b"MEMO:STOR 100.\n\r", b"MEMO:STOR 100.\n"),
        (b"SORT:NOMV +32.0000\n\r", b"SORT:NOMV +32.0000\n"),
        (b"MAIN:SPEE:FAST\nMAIN:TRIG:MANU\n\r", b"MAIN:SPEE:FAST\nMAIN:TRIG:MANU\n"),
        (b"*IDN?\n\r", b""),
        (b"COMU:OFF.\n\rMAIN:FREQ?\n\r", b"COMU:OFF.\n"),
    ],
)
def test_lcr(sent, reply):
    assert said(online(), sent) == reply


def test_lcr_without_a_session_says_nothing():
    assert said(Lcr800Device(lambda: 1e-6), b"MAIN:FREQ?\n\rCOMU:OVER\n\r") == b""


def test_lcr_out_of_range():
    device = online()
    said(device, b"MAIN:MODE:CD\n\r")
    device.secondary_over = True
    assert said(device, b"MAIN:STAR\n\r") == b"MAIN:PRIM  4.9900\nSECO:OVER uF\n"
    device.overrange = True
    assert said(device, b"MAIN:STAR\n\r") == b"PRIM:OVER\n"
    device.overrange, device.source = False, lambda: None
    assert said(device, b"MAIN:STAR\n\r") == b"PRIM:OV01\n"


def test_lcr_that_triggers_itself_streams():
    now = [0.0]
    device = Lcr800Device(lambda: 4.99e-6, clock=lambda: now[0])
    said(device, b"COMU?\n\rCOMU:OVER\n\rMAIN:MODE:CD\n\r")
    assert device.unsolicited() == []
    now[0] = 1.0
    assert device.unsolicited() == [b"MAIN:PRIM  4.9900\n", b"MAIN:SECO  .0145uF\n"]
    said(device, b"MAIN:TRIG:MANU\n\r")
    now[0] = 2.0
    assert device.unsolicited() == []


@pytest.mark.parametrize(
    ("farads", "shown"),
    [
        (5.1e-6, ("5.1000", "uF")),
        (10.03e-6, ("10.030", "uF")),
        (499e-9, ("499.00", "nF")),
        (0.12e-12, (".12000", "pF")),
        (99.99996e-6, ("100.00", "uF")),
    ],
)
def test_five_digits(farads, shown):
    assert _scaled(farads) == shown


@pytest.mark.parametrize(
    ("metres", "frame"),
    [(-5.23e-3, b"-    5.2300  =A\r\n"), (3.5e-6, b"+    0.0035  =A\r\n"), (0.0, b"+    0.0000  =A\r\n")],
)
def test_heidenhain_frame(metres, frame):
    assert len(frame) == 17
    assert said(HeidenhainDevice(lambda: metres), b"\x02") == frame


def test_heidenhain_commands():
    device = HeidenhainDevice(lambda: -3.5e-6, blank_lines=1)
    assert said(device, b"\x02") == b"-    0.0035  =A\r\n\r\n"
    identification = said(device, b"\x1bA0000\r")
    assert identification == b"\x02ND-287    \r\n349797-01 \r\nID 0001   \r\n"
    assert len(identification) == 37
    assert said(device, b"\x1bA0200\r") == b"\x02-000000035\r\n"
    assert said(device, b"\x1bF0000\r") == b"\x06"
    assert said(device, b"\x1bX9999\r") == b"\x15"
    assert said(device, b"\x05") == b"NO ERROR\r\n"
    assert said(device, b"\x1bF0200\r") == b"\x06-    0.0035  =A\r\n"
    device.overrange = True
    assert said(device, b"\x05") == b"SIGNAL TOO SMALL\r\n"
    assert said(device, b"\x02")[12:13] == b"?"


def test_heidenhain_output_is_held_and_released():
    device = HeidenhainDevice(lambda: 0.0)
    assert said(device, b"\x13\x02") == b""
    assert said(device, b"\x11") == b"+    0.0000  =A\r\n"


def test_damage_is_damage():
    """Each seed changes the bytes or, rarely, puts the same byte back."""
    reply = b"-365.000um\r\n"
    changed = sum(damaged(reply, LineFault(FaultKind.GARBAGE, seed=s)) != reply for s in range(500))
    assert changed > 490


def test_a_simulated_line_can_be_opened_again_and_again(tmp_path):
    """A pseudo-terminal by itself refuses 7E2 the second time."""
    link = Link(LineSettings(str(tmp_path / "port"), 9600, 7, "even", 2, "none"))
    with Server(OptorsDevice(lambda: 0.0), tmp_path / "port"):
        for _ in range(5):
            link.send(b"?\r")
            assert link.read_until(b"\n", Deadline(2.0)) == b"0.0000mm\r\n"
            link.close()
