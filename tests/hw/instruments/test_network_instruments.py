"""SCPI meters and the interferometer against peers on a TCP port, by VISA and by pyvisa-sim."""

import time
from contextlib import closing

import pytest

from hw.errors import (
    Garbled,
    Implausible,
    InstrumentRefused,
    NoReply,
    OverRange,
    SettingsError,
    Unplugged,
    WrongInstrument,
)
from hw.instruments import open_instrument
from hw.instruments.scpi_lcr import PROFILES, parse_measured
from specs.bench import InstrumentEntry
from tests.hw.peers.ids3010 import Ids3010Peer
from tests.hw.peers.network import served
from tests.hw.peers.scpi_lcr import E4980aPeer


def meter(where: str, **more):
    settings = {"profile": "keysight", "timeout_s": 1.0, **more}
    host, number = where.split(":")
    resource = f"TCPIP::{host}::{number}::SOCKET"
    entry = InstrumentEntry(
        driver="scpi_lcr", measures=["capacitance"], model="E4980A", serial="MY46412345", resource=resource,
        settings=settings,
    )  # fmt: skip
    return open_instrument("lcr", entry, input)


def ids(where: str, **more):
    settings = {"axis": 0, "pass_mode": 0, "range_mm": [-5.0, 5.0], "timeout_s": 1.0, "quiet_s": 0.05, **more}
    entry = InstrumentEntry(
        driver="ids3010", measures=["stroke"], serial="L01234567", resource=where, settings=settings
    )
    return open_instrument("ids", entry, input)


def test_a_meter_by_visa():
    peer = E4980aPeer()
    peer.truth = 4.99e-6
    with served(peer) as where:
        lcr = meter(where)
        assert lcr.connect().serial == "MY46412345"
        reading = lcr.read()
        lcr.confirm()
        lcr.close()
    assert reading.value == pytest.approx(4.99e-6)
    assert reading.more == {"D": pytest.approx(0.0145)}
    assert (reading.settings["averaging"], reading.settings["cable"]) == ("LONG,4", "1")
    assert (reading.settings["open correction"], reading.settings["serial"]) == ("1", "MY46412345")


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda p: setattr(p, "serial", "MY00000001"), WrongInstrument, "serial number 'MY00000001'"),
        (lambda p: setattr(p, "model", "34465A"), Garbled, "E4980A"),
        (lambda p: p.set.update({"CORR:OPEN": "0"}), InstrumentRefused, "open correction"),
        (lambda p: p.set.update({"CORR:LOAD": "1"}), InstrumentRefused, "load correction"),
        (lambda p: setattr(p, "status", 1), OverRange, "over range"),
        (lambda p: p.set.pop("FUNC:DEV1:MODE"), NoReply, "nothing"),
    ],
)
def test_a_meter_that_is_not_as_it_must_be(change, error, words):
    peer = E4980aPeer()
    peer.truth = 4.99e-6
    change(peer)
    with served(peer) as where, closing(meter(where)) as lcr, pytest.raises(error, match=words):
        lcr.read()


LEFT_BY_OTHERS = {
    "DISP:PAGE": "LIST", "INIT:CONT": "0", "FORM": "REAL", "AMPL:ALC": "1", "COMP": "1", "TRIG:SOUR": "INT",
    "CORR:LENG": "0", "FUNC:IMP": "CPD", "FREQ": "+1.20000E+02",
}  # fmt: skip


@pytest.mark.parametrize("key", LEFT_BY_OTHERS)
def test_what_another_program_left_is_set_measured_and_given_back(key):
    """A list sweep gives four fields, without continuous initiation FETC? repeats the measurement before."""
    peer = E4980aPeer()
    peer.set[key] = LEFT_BY_OTHERS[key]
    found = dict(peer.set)
    with served(peer) as where, closing(meter(where)) as lcr:
        values = []
        for peer.truth in (5.1e-6, 10.3e-6):
            values.append(lcr.read().value)
    assert values == pytest.approx([5.1e-6, 10.3e-6], rel=1e-9)
    assert peer.set == found


@pytest.mark.parametrize(("key", "value"), [("DISP:PAGE", "LIST"), ("INIT:CONT", "0"), ("FORM", "REAL"), ("COMP", "1")])
def test_what_is_changed_between_two_readings_is_refused_and_mended_by_the_next(key, value):
    peer = E4980aPeer()
    with served(peer) as where, closing(meter(where)) as lcr:
        peer.truth = 5.1e-6
        lcr.read()
        peer.truth, peer.set[key] = 10.3e-6, value
        with pytest.raises(Implausible, match="changed at the meter"):
            lcr.read()
        assert lcr.read().value == pytest.approx(10.3e-6)


def test_a_trigger_that_is_ignored_is_read_from_the_error_queue():
    """Of a meter whose settings all read as they must: nothing but the queue tells that FETC? repeats itself."""

    class Ignores(E4980aPeer):
        def _said(self, message):
            if message == "TRIG:IMM":
                return self._wrong(-211, "Trigger ignored")
            return super()._said(message)

    peer = Ignores()
    peer._data = "+5.10000E-06,+1.45000E-02,+0"
    with served(peer) as where, closing(meter(where)) as lcr, pytest.raises(InstrumentRefused, match="-211"):
        lcr.read()


def test_a_bias_that_was_on_stays_off():
    """Nothing here ever puts a voltage on a poled stack."""
    peer = E4980aPeer()
    peer.truth, peer.set["BIAS:STAT"] = 4.99e-6, "1"
    with served(peer) as where, closing(meter(where)) as lcr:
        lcr.read()
    assert peer.set["BIAS:STAT"] == "0"


@pytest.mark.parametrize(("count", "bytes_each"), [(400, 4096), (200, 1)])
def test_a_meter_that_never_ends_its_line_is_left_at_the_deadline(count, bytes_each):
    """A flood, and a byte every 5 ms: within 0.6 s and half a second for a busy machine; the bytes are kept."""

    class Endless(E4980aPeer):
        def hear(self, data):
            return [(0.005, b"7" * bytes_each)] * count

    with served(Endless()) as where:
        lcr = meter(where, deadline_s=0.6, quiet_s=0.05)
        began = time.monotonic()
        with pytest.raises((NoReply, Garbled)):
            lcr.read()
        assert time.monotonic() - began < 1.1
        kept = b"".join(t.data for t in lcr.link.take_transcript() if t.way == "read")
        lcr.close()
    assert kept.startswith(b"7")


def test_a_correction_that_may_be_off():
    peer = E4980aPeer()
    peer.truth = 4.99e-6
    peer.set["CORR:SHOR"] = "0"
    with served(peer) as where, closing(meter(where, corrections="allow")) as lcr:
        assert lcr.read().settings["short correction"] == "0"


def test_a_meter_that_is_not_there():
    with pytest.raises(Unplugged):
        meter("127.0.0.1:9").read()
    with pytest.raises(SettingsError, match="resource is missing"):
        open_instrument("lcr", InstrumentEntry(driver="scpi_lcr", measures=[], settings={"profile": "hioki"}), input)


@pytest.mark.parametrize(
    ("said", "status", "error"),
    [
        ("+4.99000E-06,+1.45000E-02", True, Garbled),
        ("+4.99000E-06,+1.45000E-02,+0,+1", True, Garbled),  # a list sweep, or a comparator that is on
        ("+4.99000E-06,+1.45000E-02,-1", True, InstrumentRefused),
        ("+4.99000E-06,+1.45000E-02,+3", True, InstrumentRefused),
        ("+9.90000E+37,+1.45000E-02,+0", True, OverRange),
        ("NAN,1", False, Garbled),
        ("4.99E-6;0.1", False, Garbled),
        ("", False, Garbled),
    ],
)
def test_what_is_no_measurement(said, status, error):
    with pytest.raises(error):
        parse_measured("lcr", said, status)


@pytest.mark.parametrize(("profile", "model"), [("hioki", "IM3536"), ("gwinstek", "LCR-6300")])
def test_the_assumed_profiles_by_pyvisa_sim(profile, model, tmp_path):
    """A meter that answers each question of a profile as it must: session, reading, confirmation, by VISA."""
    trigger, question = PROFILES[profile].measure.split(";")  # which the simulator takes apart
    answers = {"*IDN?": f"MAKER,{model},123456,V1.0", question: "4.99000E-06,0.01450", "*OPC?": "1"}
    values = {"volt": 1.0, "average": 4, "cable": 1, "level_control": 0}
    settings = PROFILES[profile].settings.values()
    answers |= {f"{s.header}?": s.wanted.format(**values) for s in settings}
    commands = [trigger, *(f"{s.header} {s.wanted.format(**values)}" for s in settings if s.sets)]
    lines = [
        'spec: "1.1"',
        "devices:",
        "  meter:",
        "    eom:",
        "      GPIB INSTR:",
        '        q: "\\n"',
        '        r: "\\n"',
    ]
    lines += ["    dialogues:"]
    for question, answer in answers.items():
        lines += [f"      - q: '{question}'", f"        r: '{answer}'"]
    for command in commands:
        lines += [f"      - q: '{command}'"]
    lines += ["resources:", "  GPIB0::17::INSTR:", "    device: meter", ""]
    (tmp_path / "meter.yaml").write_text("\n".join(lines))
    entry = InstrumentEntry(
        driver="scpi_lcr", measures=[], serial="123456", resource="GPIB0::17::INSTR",
        settings={"profile": profile, "library": f"{tmp_path}/meter.yaml@sim"},
    )  # fmt: skip
    lcr = open_instrument("lcr", entry, input)
    lcr.connect()
    assert lcr.read().value == pytest.approx(4.99e-6)
    lcr.confirm()
    lcr.close()


def test_the_interferometer():
    peer = Ids3010Peer()
    peer.truth = 123.4567e-6
    with served(peer) as where:
        interferometer = ids(where)
        assert interferometer.connect().serial == "L01234567"
        reading = interferometer.read()
        interferometer.confirm()
        interferometer.close()
    assert reading.value == pytest.approx(123.4567e-6, rel=1e-9)
    assert reading.settings["pass mode"] == "0"


@pytest.mark.parametrize("name", ["averaging", "reference_pm"])
def test_an_axis_that_is_reset_or_averaged_otherwise_in_the_middle_of_a_record(name):
    """Both make or smear a step; one question goes with each sample, each of them in its turn."""
    peer = Ids3010Peer()
    with served(peer) as where, closing(ids(where)) as interferometer:
        interferometer.connect()
        assert interferometer.read().value == pytest.approx(0.0, abs=1e-12)
        setattr(peer, name, 9)
        with pytest.raises(Implausible, match="was it changed"):
            all(interferometer.sample() for _ in range(6))


def test_an_older_interface_tells_no_averaging():
    class Older(Ids3010Peer):
        def _said(self, request):
            request["method"] = request["method"].replace("getAverageN", "getSomething")
            return super()._said(request)

    with served(Older()) as where, closing(ids(where)) as interferometer:
        interferometer.connect()
        assert interferometer.read().settings["averaging N"] == "not told"


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda p: p.panel["measurement stopped"](), InstrumentRefused, "not running"),
        (lambda p: p.panel["dual pass"](), Implausible, "pass mode"),
        (lambda p: p.panel["beam lost"](), Implausible, "contrast"),
        (lambda p: setattr(p, "serial", "L9"), WrongInstrument, "L9"),
        (lambda p: setattr(p, "truth", 6e-3), Implausible, "outside -5 to 5 mm"),
    ],
)
def test_an_interferometer_that_is_not_as_it_must_be(change, error, words):
    peer = Ids3010Peer()
    change(peer)
    with served(peer) as where, closing(ids(where)) as interferometer, pytest.raises(error, match=words):
        interferometer.read()


@pytest.mark.parametrize(
    "line",
    [
        b"{}",
        b"[1]",
        b'{"id": 1, "result": 5}',
        b'{"id": 99, "result": [0, 1]}',
        b"\xff",
        b"[" * 9000,
        b'{"id": 1, "result": []}',
    ],
)
def test_an_answer_that_is_none(line):
    class Odd(Ids3010Peer):
        def hear(self, data):
            return [(0.0, line + b"\r\n")]

    with served(Odd()) as where, closing(ids(where)) as interferometer, pytest.raises((Garbled, InstrumentRefused)):
        interferometer.read()


def test_an_address_that_is_none():
    with pytest.raises(SettingsError, match="host:number"):
        ids("192.168.1.1").read()
