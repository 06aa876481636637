"""No digit of a damaged reply ever becomes a reading: framing, unit and plausibility are checked, and two answers must
agree. Damage of every kind by hypothesis."""

import re
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.errors import InstrumentError
from hw.instruments.heidenhain import Heidenhain, HeidenhainSettings, Nd287Settings, parse_frame
from hw.instruments.lcr800 import Lcr800, Lcr800Settings, parse_results
from hw.instruments.manual import ManualSettings, parse_typed
from hw.instruments.millimar import MillimarSettings, parse_value
from hw.instruments.millimar_protocols import M1240Settings, MillimarM1240, MillimarOptors, OptorsSettings
from hw.link import Link
from hw.simulated import HeidenhainDevice, Lcr800Device, M1240Device, OptorsDevice
from tests.hw.instruments.dialogue import LINE, DevicePort

TIMES = settings(max_examples=150)
METRES = st.floats(-0.9e-3, 0.9e-3)
FARADS = st.floats(0.1e-6, 20e-6)
DIGITS = st.sampled_from([bytes([b]) for b in b"0123456789.-+ "])
DAMAGE = st.lists(
    st.tuples(
        st.sampled_from(["replace", "remove", "add"]), st.integers(0, 60), st.binary(min_size=1, max_size=1) | DIGITS
    ),
    min_size=1,
    max_size=5,
)


def damage(reply: bytes, changes) -> bytes:
    data = bytearray(reply)
    for how, where, byte in changes:
        at = where % (len(data) + 1)
        if how == "add":
            data[at:at] = byte
        else:
            data[at : at + 1] = byte if how == "replace" else b""
    return bytes(data)


class Damaged(DevicePort):
    """The line of a device that damages the replies from number `first` on, `count` of them."""

    def __init__(self, device, first, count, changes):
        super().__init__(device)
        self.hit, self.changes, self.number = range(first, first + count), changes, 0

    def write(self, data, /):
        for reply in self.device.feed(data):
            self.out += damage(reply, self.changes) if self.number in self.hit else reply
            self.number += 1
        return len(data)


def outcome(make, device, first, changes):
    """The reading, or None for a clear error. One reply of all that a reading takes is damaged."""
    port = Damaged(device, first, 1, changes)
    with suppress(InstrumentError):
        return make(Link(LINE, lambda _: port, lambda: port.now)).read().value
    return None


@TIMES
@given(METRES, st.integers(0, 12), DAMAGE)
def test_optorsd(truth, first, changes):
    wanted = OptorsSettings(protocol="OPTORSD", unit="um", formula="+1", range_mm=[-1.0, 1.0])
    device = OptorsDevice(lambda: truth, unit="um", serial="1/2")
    found = outcome(lambda link: MillimarOptors("g", link, wanted, "C1216", "1/2"), device, first, changes)
    assert found is None or abs(found - truth) <= 0.251e-6  # half of the agreement, and of the last digit


@TIMES
@given(METRES, st.integers(0, 9), DAMAGE)
def test_m1240(truth, first, changes):
    wanted = M1240Settings(protocol="M1240", unit="um", range_mm=[-1.0, 1.0])
    device = M1240Device(lambda: truth, unit="um")
    found = outcome(lambda link: MillimarM1240("g", link, wanted, "C1216"), device, first, changes)
    assert found is None or abs(found - truth) <= 0.251e-6


@TIMES
@given(METRES, st.integers(0, 3), DAMAGE)
def test_heidenhain(truth, first, changes):
    wanted = Nd287Settings(range_mm=[-1.0, 1.0], axis="single", identification="ND-287")
    found = outcome(lambda link: Heidenhain("p", link, wanted), HeidenhainDevice(lambda: truth), first, changes)
    assert found is None or abs(found - truth) <= 0.31e-6  # its last digit is 0.1 um


@TIMES
@given(FARADS, st.integers(0, 34), DAMAGE)
def test_lcr800(truth, first, changes):
    wanted = Lcr800Settings()
    found = outcome(lambda link: Lcr800("l", link, wanted), Lcr800Device(lambda: truth), first, changes)
    assert found is None or abs(found - truth) <= 0.0007 * truth + 1e-12  # half of 0.1 %, and of the last of 5 digits


@given(st.binary(max_size=30) | st.from_regex(rb"[ +-]*\d{0,4}[.,]?\d{0,5} ?(mm|um|in|m)?", fullmatch=True))
def test_only_a_number_with_its_unit_is_a_value(line):
    """What the parser takes is held against a grammar of its own."""
    with suppress(InstrumentError):
        metres, _ = parse_value(
            "g", line, MillimarSettings(protocol="OPTORSD", unit="mm", range_mm=[-99.0, 99.0], resolution_um=1e3)
        )
        found = re.fullmatch(rb" *([+-]?) *(\d+\.\d+)mm *", line)
        assert found, line
        assert metres == float(found[1] + found[2]) * 1e-3


@given(st.binary(max_size=20) | st.from_regex(rb"[ +-] {0,6}\d{1,4}[. ]\d{2,5} [ \"?][<=>?][ASGD]", fullmatch=True))
def test_only_whole_frames_are_values(line):
    with suppress(InstrumentError):
        metres, _ = parse_frame("p", line, HeidenhainSettings(range_mm=[-1e6, 1e6], resolution_um=1e6))
        assert len(line) == 15
        number = line[1:11].decode().strip()
        assert metres == float(number) * (-1 if line[:1] == b"-" else 1) * (25.4e-3 if line[12:13] == b'"' else 1e-3)


@given(st.binary(max_size=30) | st.from_regex(rb"MAIN:PRIM {0,3}-?\d{0,4}\.?\d{0,5}", fullmatch=True))
def test_only_five_digits_are_a_capacitance(line):
    with suppress(InstrumentError):
        C, D = parse_results("l", line, b"MAIN:SECO  .0145uF", Lcr800Settings())
        number = line.removeprefix(b"MAIN:PRIM ").decode()
        assert len(number) in (6, 7)
        assert len(number.replace(".", "").strip(" -")) == 5
        assert (C, D) == (float(number) * 1e-6, 0.0145)


@given(st.text(max_size=20) | st.from_regex(r"[+-]?\d{0,3}[.,]?\d{0,3} ?(uF|nF|mm)?", fullmatch=True))
@pytest.mark.slow
def test_only_a_typed_number_with_its_unit(typed):
    with suppress(InstrumentError):
        farads = parse_typed("m", typed, ManualSettings(measure="capacitance", unit="uF", range=[0.1, 50.0]), "F")
        assert 0.1e-6 <= farads <= 50e-6
        assert re.fullmatch(r"\s*\+?[0-9.]+\s*(F|uF|µF|μF|nF|pF)\s*", typed)
