"""Millimar dialogues: every command and every error of OPTORSD, OPTORSS and M1240, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange, WrongInstrument
from hw.instruments.millimar_m1240 import M1240Settings, MillimarM1240
from hw.instruments.millimar_optors import MillimarOptors, OptorsSettings
from hw.link import Deadline
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "deadline_s": 2.0}
UNIT = ((b"mm\r", b"OK\r\n"), (b"UNI?\r", b"mm \r\n"))
WHO = ((b"ID?\r", b"MAHR GMBH,C1216 \r\n"), (b"SER?\r", b"1234/56\r\n"))
START = (*UNIT, *WHO)


def optorsd(link, model="C1216", serial="1234/56", **more):
    settings = {"protocol": "OPTORSD", "unit": "mm", "range_mm": [-2.0, 2.0], **FAST, **more}
    return MillimarOptors("gauge", link, OptorsSettings(**settings), model, serial)


def m1240(link, **more):
    settings = {"protocol": "M1240", "unit": "mm", "range_mm": [-2.0, 2.0], **FAST, **more}
    return MillimarM1240("gauge", link, M1240Settings(**settings), "C1216")


def test_a_reading_is_two_answers_that_agree():
    with dialogue(*START, (b"?\r", b"-0.365mm\r\n"), (b"?\r", b"-0.3654mm\r\n")) as link:
        reading = optorsd(link).read()
    assert reading.value == pytest.approx(-0.3652e-3, abs=1e-12)  # their mean, exact but for rounding
    assert reading.unit == "m"
    assert reading.raw == (b"-0.365mm", b"-0.3654mm")


def test_a_second_reading_asks_who_it_is_but_sets_nothing_again():
    value = (b"?\r", b"0.100mm\r\n")
    with dialogue(*START, value, value, *WHO, value, value) as link:
        gauge = optorsd(link)
        assert gauge.read().value == gauge.read().value


@pytest.mark.parametrize(("unit", "reply", "metres"), [("in", "0.0100in", 254e-6), ("um", "365.5um", 365.5e-6)])
def test_other_units(unit, reply, metres):
    steps = ((unit.encode() + b"\r", b"\r\n"), (b"UNI?\r", unit.encode() + b"\r\n"), *WHO)
    value = (b"?\r", reply.encode() + b"\r\n")
    with dialogue(*steps, value, value) as link:
        assert optorsd(link, unit=unit).read().value == pytest.approx(metres, rel=1e-12)


def test_a_micrometre_spelled_as_a_byte_beyond_ascii():
    """How the wire spells it is not published: the bench file can say."""
    value = (b"?\r", b"12.5\xb5m\r\n")
    with dialogue(value, value) as link:
        settings = OptorsSettings(protocol="OPTORSS", unit="um", range_mm=[-1.0, 1.0], micrometre="µm", **FAST)
        assert MillimarOptors("gauge", link, settings).read().value == pytest.approx(12.5e-6)


def test_optorss_only_asks_for_the_value():
    with dialogue((b"?\r", b"0.001mm\r\n"), (b"?\r", b"0.001mm\r\n")) as link:
        assert optorsd(link, protocol="OPTORSS").read().value == pytest.approx(1e-6)


def test_version_and_display():
    with dialogue((b"VER?\r", b"1.02_\r\n"), (b"DIS APA-03\r", b"\r\n")) as link:
        gauge = optorsd(link)
        assert gauge.version() == "1.02"
        gauge.show("APA-03")


def test_a_text_too_long_for_the_display_is_never_sent():
    with dialogue() as link, pytest.raises(ValueError, match="at most 7"):
        optorsd(link).show("APA-03 today")


@pytest.mark.parametrize(
    ("formula", "readback"),
    [("+1", "C1"), ("-1", "-C1"), ("+2", "+C2"), ("-2", "-C2"), ("+1+2", "+C1+C2"), ("+1-2", "+C1-C2"),
     ("+2-1", "C2-C1"), ("-1-2", "-C1-C2")],
)  # fmt: skip
def test_every_formula_is_set_and_read_back(formula, readback):
    setting = (f"CHA{formula}\r".encode(), b"OK\r\n"), (b"CHA?\r", readback.encode() + b"\r\n")
    with dialogue(*UNIT, *setting, *WHO) as link:
        optorsd(link, formula=formula).connect()


def test_a_formula_that_does_not_change():
    """With two features only FEAT. 1 can be changed (manual)."""
    setting = (b"CHA+1\r", b"OK\r\n"), (b"CHA?\r", b"-C1-C2\r\n")
    with dialogue(*UNIT, *setting) as link, pytest.raises(Implausible, match="did not change"):
        optorsd(link, formula="+1").connect()


def test_settings_without_acknowledgement():
    with dialogue((b"mm\r", b""), (b"UNI?\r", b"mm \r\n"), *WHO) as link:
        assert optorsd(link, acknowledged=False).connect().model == "C1216"


def test_a_unit_that_does_not_change():
    with dialogue((b"mm\r", b"OK\r\n"), (b"UNI?\r", b"in \r\n")) as link, pytest.raises(Implausible, match="'in'"):
        optorsd(link).read()


@pytest.mark.parametrize(("reply", "words"), [(b"MAHR GMBH,C1208 \r\n", "C1208"), (b"COMU:ON..\r\n", "MAHR")])
def test_another_model_answers(reply, words):
    steps = [*UNIT, (b"ID?\r", reply)] + ([WHO[1]] if b"," in reply else [])
    with dialogue(*steps) as link, pytest.raises((WrongInstrument, Garbled), match=words):
        optorsd(link).read()


def test_another_serial_number_answers():
    with dialogue(*START) as link, pytest.raises(WrongInstrument, match="swapped"):
        optorsd(link, serial="9999/99").read()


@pytest.mark.parametrize(
    ("reply", "error", "words"),
    [
        (b"ERR0\r\n", InstrumentRefused, "sensor error"),
        (b"ERR1\r\n", InstrumentRefused, "does not know"),
        (b"ERR2\r\n", InstrumentRefused, "parity"),
        (b"ERR3\r\n", OverRange, "range"),
        (b"ERR5\r\n", InstrumentRefused, "probe"),
        (b"ERR6\r\n", InstrumentRefused, "feature"),
        (b"ERR9\r\n", InstrumentRefused, "no meaning"),
        (b"OV\r\n", OverRange, "out of range"),
        (b"0.365in\r\n", Implausible, "is in in"),
        (b"0.365um\r\n", Implausible, "is in um"),
        (b"3.365mm\r\n", Implausible, "outside -2 to 2 mm"),
        (b"0.365\r\n", Garbled, "its unit"),
        (b"0.365m\r\n", Garbled, "unit 'm'"),
        (b"0.3\x8065mm\r\n", Garbled, "a number"),
        (b"0,365mm\r\n", Garbled, "a number"),
        (b"365mm\r\n", Garbled, "a number"),
        (b"\r\n", Garbled, "a number"),
        (b"+-0.365mm\r\n", Garbled, "a number"),
    ],
)
def test_errors_and_damage_are_no_reading(reply, error, words):
    with dialogue(*START, (b"?\r", reply)) as link, pytest.raises(error, match=words):
        optorsd(link).read()


def test_two_answers_that_disagree():
    """12.3 and a damaged 18.3 look alike; only the second answer tells."""
    steps = ((b"?\r", b"0.365mm\r\n"), (b"?\r", b"0.865mm\r\n"))
    with dialogue(*START, *steps) as link, pytest.raises(Implausible, match="two readings in a row"):
        optorsd(link).read()


@pytest.mark.parametrize("reply", [b"1.365mm", b"01.365mm", b"0.36mm", b"0.3655mm"])
def test_digits_of_a_display_that_are_fixed(reply):
    good = {"integer_digits": 1, "decimals": 3}
    with dialogue(*START, (b"?\r", reply + b"\r\n"), *([(b"?\r", reply + b"\r\n")] if len(reply) == 7 else [])) as link:
        if reply == b"1.365mm":
            assert optorsd(link, **good).read().value == pytest.approx(1.365e-3)
        else:
            with pytest.raises(Garbled, match="digits"):
                optorsd(link, **good).read()


def test_silence_says_what_to_look_at():
    with dialogue(*START, (b"?\r", b"")) as link, pytest.raises(NoReply, match=r"menu open.*master measurement"):
        optorsd(link).read()


def test_half_a_line_is_no_reading():
    with dialogue(*START, (b"?\r", b"0.365m")) as link, pytest.raises(NoReply, match=r"only b'0\.365m'"):
        optorsd(link).read()


def test_bytes_that_came_unasked_are_no_answer():
    """The DATA key was pressed: its value must not be taken for the answer to the next question."""
    data = b"0.365mm\r\n0.111mm\r\n"
    with dialogue(*START, (b"?\r", data)) as link, pytest.raises(Garbled, match="unasked"):
        optorsd(link).read()


def test_a_new_session_drops_what_lies_on_the_line():
    value = (b"?\r", b"0.100mm\r\n")
    with dialogue((b"", b"0.999mm\r\n"), *START, value, value) as link:
        assert optorsd(link).read().value == pytest.approx(1e-4)
        assert b"dropped" in b"".join(t.way.encode() for t in link.take_transcript())


def test_after_an_error_everything_is_set_again():
    value = (b"?\r", b"0.100mm\r\n")
    with dialogue(*START, (b"?\r", b"OV\r\n"), *START, value, value) as link:
        gauge = optorsd(link)
        with pytest.raises(OverRange):
            gauge.read()
        assert gauge.read().value == pytest.approx(1e-4)


ASKED = (b"I\r", b"I,MAHRGMBH,C1216,V1.02\r")
P86 = (b"P86,1\r", b"\r")


def test_m1240_sets_the_unit_before_every_value():
    with dialogue(ASKED, P86, (b"M\r", b"M1, 0.365\r"), P86, (b"M\r", b"M1, 0.365\r")) as link:
        assert m1240(link).read().value == pytest.approx(0.365e-3)


@pytest.mark.parametrize(("unit", "code", "text"), [("in", b"P86,2", b"0.010"), ("um", b"P86,3", b" 254.0")])
def test_m1240_units(unit, code, text):
    once = ((code + b"\r", b"\r"), (b"M\r", b"M1, " + text + b"\r"))
    with dialogue(ASKED, *once, *once) as link:
        assert m1240(link, unit=unit).read().value == pytest.approx(254e-6)


@pytest.mark.parametrize(("how", "reply"), [("echo", b"P86,1\r"), ("none", b"")])
def test_m1240_other_acknowledgements(how, reply):
    once = ((b"P86,1\r", reply), (b"M\r", b"M1, 0.365\r"))
    with dialogue(ASKED, *once, *once) as link:
        assert m1240(link, acknowledged=how).read().value == pytest.approx(0.365e-3)


def test_m1240_identity_as_the_sibling_writes_it():
    with dialogue((b"I\r", b"I,MAHR GMBH,M1245,V1.10\r")) as link:
        said = MillimarM1240(
            "g", link, M1240Settings(protocol="M1240", unit="mm", range_mm=[-2.0, 2.0], **FAST)
        ).connect()
    assert (said.model, said.firmware) == ("M1245", "V1.10")


@pytest.mark.parametrize(
    ("reply", "error"),
    [
        (b"M1, 0.3x5\r", Garbled), (b"M2, 0.365\r", Garbled), (b"M1, \r", Garbled), (b"0.365\r", Garbled),
        (b"M1, 5.365\r", Implausible), (b"ERR5\r", InstrumentRefused), (b"OV\r", OverRange), (b"", NoReply),
    ],
)  # fmt: skip
def test_m1240_errors_are_no_reading(reply, error):
    with dialogue(ASKED, P86, (b"M\r", reply)) as link, pytest.raises(error):
        m1240(link).read()


def test_m1240_a_unit_that_is_not_acknowledged():
    with dialogue(ASKED, (b"P86,1\r", b"ERR1\r")) as link, pytest.raises(InstrumentRefused):
        m1240(link).read()


@pytest.mark.parametrize(
    ("do", "sent"),
    [
        (lambda g: g.start(), b"F2\r"), (lambda g: g.start(timed=True), b"F1\r"), (lambda g: g.stop(), b"F3\r"),
        (lambda g: g.reset(), b"R\r"), (lambda g: g.master(), b"Z\r"),
    ],
)  # fmt: skip
def test_m1240_commands_are_echoed(do, sent):
    with dialogue((sent, sent)) as link:
        do(m1240(link))
    with dialogue((sent, b"ERR3\r")) as link, pytest.raises(InstrumentRefused):
        do(m1240(link))


def test_m1240_stored_values():
    with dialogue((b"M70\r", b"00001, -0.365\r00002, 1.000\r")) as link:
        values = m1240(link).stored()
    assert [(n, v) for n, v, _ in values] == [(1, pytest.approx(-0.365e-3)), (2, pytest.approx(1e-3))]


def test_m1240_stored_values_that_are_damaged_stay_in_the_transcript():
    """Reading deletes them in the instrument: the transcript is then the only place that has them."""
    with dialogue((b"M70\r", b"00001, -0.365\r0002 1.000\r")) as link:
        gauge = m1240(link)
        with pytest.raises(Garbled, match="transcript"):
            gauge.stored()
        kept = b"".join(t.data for t in link.take_transcript() if t.way == "read")
    assert kept == b"00001, -0.365\r0002 1.000\r"


def test_a_question_within_a_deadline_that_has_passed():
    with dialogue((b"ID?\r", b"")) as link, pytest.raises(NoReply):
        optorsd(link).question("ID?", Deadline(0.0))
