"""Millimar dialogues: every command and every error of OPTORSD, OPTORSS and M1240, byte for byte."""

import pytest

from hw.errors import Garbled, Implausible, InstrumentRefused, NoReply, OverRange, WrongInstrument
from hw.instruments.millimar_protocols import M1240Settings, MillimarM1240, MillimarOptors, OptorsSettings
from tests.hw.instruments.dialogue import dialogue

FAST = {"timeout_s": 0.05, "quiet_s": 0.005, "deadline_s": 2.0}
SET = ((b"mm\r", b"OK\r\n"), (b"CHA-1-2\r", b"OK\r\n"))
WHO = ((b"ID?\r", b"MAHR GMBH,C1216 \r\n"), (b"SER?\r", b"1234/56\r\n"))
ASKED = ((b"UNI?\r", b"mm \r\n"), (b"CHA?\r", b"-C1-C2\r\n"))  # as page 69 prints it
CHECKED = (*WHO, *ASKED)
START = (*SET, *CHECKED)


def optorsd(link, model="C1216", serial="1234/56", **more):
    settings = {"protocol": "OPTORSD", "unit": "mm", "formula": "-1-2", "range_mm": [-2.0, 2.0], **FAST, **more}
    return MillimarOptors("gauge", link, OptorsSettings(**settings), model, serial)


def m1240(link, **more):
    settings = {"protocol": "M1240", "unit": "mm", "range_mm": [-2.0, 2.0], **FAST, **more}
    return MillimarM1240("gauge", link, M1240Settings(**settings), "C1216")


def test_a_reading_is_three_answers_that_agree():
    answers = [(b"?\r", text) for text in (b"-0.365mm\r\n", b"-0.366mm\r\n", b"-0.364mm\r\n")]
    with dialogue(*START, *answers, *CHECKED) as link:
        reading = optorsd(link, agreement_um=2.5).read()
    assert reading.value == pytest.approx(-0.365e-3, abs=1e-12)  # their mean, exact but for rounding
    assert reading.unit == "m"
    assert reading.raw == (b"-0.365mm", b"-0.366mm", b"-0.364mm")
    assert reading.settings == {
        "model": "C1216", "serial": "1234/56", "unit": "mm", "formula": "-C1-C2", "decimals": "3"
    }  # fmt: skip


def test_a_second_reading_asks_everything_but_sets_nothing_again():
    values = [(b"?\r", b"0.100mm\r\n")] * 3
    with dialogue(*START, *values, *CHECKED, *CHECKED, *values, *CHECKED) as link:
        gauge = optorsd(link)
        assert gauge.read().value == gauge.read().value


@pytest.mark.parametrize(("unit", "reply", "metres"), [("in", "0.01000in", 254e-6), ("um", "365.5um", 365.5e-6)])
def test_other_units(unit, reply, metres):
    asked = (*WHO, (b"UNI?\r", unit.encode() + b"\r\n"), ASKED[1])
    values = [(b"?\r", reply.encode() + b"\r\n")] * 3
    with dialogue((unit.encode() + b"\r", b"\r\n"), SET[1], *asked, *values, *asked) as link:
        assert optorsd(link, unit=unit).read().value == pytest.approx(metres, rel=1e-12)


def test_a_micrometre_spelled_as_a_byte_beyond_ascii():
    """How the wire spells it is not published: the bench file can say."""
    value = (b"?\r", b"12.5\xb5m\r\n")
    with dialogue(value, value, value) as link:
        settings = OptorsSettings(protocol="OPTORSS", unit="um", range_mm=[-1.0, 1.0], micrometre="µm", **FAST)
        assert MillimarOptors("gauge", link, settings).read().value == pytest.approx(12.5e-6)


def test_optorss_only_asks_for_the_value():
    with dialogue(*[(b"?\r", b"0.001mm\r\n")] * 3) as link:
        assert optorsd(link, protocol="OPTORSS").read().value == pytest.approx(1e-6)


def test_an_answer_too_many_is_no_reading():
    """OPTORSS tells nothing to hold an answer to: after the last one nothing more may come."""
    steps = (*[(b"?\r", b"0.001mm\r\n")] * 2, (b"?\r", b"0.001mm\r\n0.001mm\r\n"))
    with dialogue(*steps) as link, pytest.raises(Garbled, match="unasked"):
        optorsd(link, protocol="OPTORSS").read()


@pytest.mark.parametrize(
    ("formula", "readback"),
    [("+1", "C1"), ("-1", "-C1"), ("+2", "+C2"), ("-2", "-C2"), ("+1+2", "+C1+C2"), ("+1-2", "+C1-C2"),
     ("+2-1", "C2-C1"), ("-1-2", "-C1-C2")],
)  # fmt: skip
def test_every_formula_is_set_and_read_back(formula, readback):
    asked = (*WHO, ASKED[0], (b"CHA?\r", readback.encode() + b"\r\n"))
    with dialogue(SET[0], (f"CHA{formula}\r".encode(), b"OK\r\n"), *asked) as link:
        optorsd(link, formula=formula).connect()


def test_a_formula_that_does_not_change():
    """With two features only FEAT. 1 can be changed (manual)."""
    with dialogue(SET[0], (b"CHA+1\r", b"OK\r\n"), *CHECKED) as link, pytest.raises(Implausible, match="FEAT"):
        optorsd(link, formula="+1").connect()


def test_a_formula_must_be_said():
    with pytest.raises(ValueError, match="formula is missing"):
        OptorsSettings(protocol="OPTORSD", unit="mm", range_mm=[-2.0, 2.0])


@pytest.mark.parametrize(("n", "reply"), [(0, b"in \r\n"), (1, b"C1\r\n")])
@pytest.mark.parametrize("end", [False, True])
def test_unit_and_formula_changed_at_the_gauge(n, reply, end):
    """Asked after every value, and at the end of a run before anything is set."""
    values = [(b"?\r", b"0.100mm\r\n")] * 3
    changed = tuple((message, reply if message == ASKED[n][0] else said) for message, said in CHECKED)
    with dialogue(*START, *values, *(CHECKED if end else ()), *changed) as link:
        gauge = optorsd(link)
        if end:
            gauge.read()
        with pytest.raises(Implausible, match="was it changed"):
            gauge.confirm() if end else gauge.read()


def test_settings_without_acknowledgement():
    with dialogue(*((message, b"") for message, _ in SET), *CHECKED) as link:
        assert optorsd(link, acknowledged=False).connect().model == "C1216"


def test_a_unit_that_does_not_change():
    steps = (*SET, *WHO, (b"UNI?\r", b"in \r\n"), ASKED[1])
    with dialogue(*steps) as link, pytest.raises(Implausible, match="'in'"):
        optorsd(link).read()


@pytest.mark.parametrize(("reply", "words"), [(b"MAHR GMBH,C1208 \r\n", "C1208"), (b"COMU:ON..\r\n", "MAHR")])
def test_another_model_answers(reply, words):
    steps = [*SET, (b"ID?\r", reply)] + ([WHO[1]] if b"," in reply else [])
    with dialogue(*steps) as link, pytest.raises((WrongInstrument, Garbled), match=words):
        optorsd(link).read()


def test_another_serial_number_answers():
    with dialogue(*SET, *WHO) as link, pytest.raises(WrongInstrument, match="swapped"):
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
        (b"OV\r\n", OverRange, "over range"),
        (b"-----\r\n", OverRange, "over range"),
        (b"0.365in\r\n", Implausible, "is in in"),
        (b"0.365um\r\n", Implausible, "is in um"),
        (b"3.365mm\r\n", Implausible, "outside -2 to 2 mm"),
        (b"0.365\r\n", Garbled, "its unit"),
        (b"0.365m\r\n", Garbled, "unit 'm'"),
        (b"0.3\x8065mm\r\n", Garbled, "a number"),
        (b"0,365mm\r\n", Garbled, "decimal comma"),
        (b"0.36mm\r\n", Implausible, "steps of 10 um"),
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
    steps = ((b"?\r", b"0.365mm\r\n"), (b"?\r", b"0.865mm\r\n"), (b"?\r", b"0.365mm\r\n"))
    with dialogue(*START, *steps) as link, pytest.raises(Implausible, match="readings in a row differ"):
        optorsd(link).read()


@pytest.mark.parametrize("reply", [b"1.365mm", b"01.365mm", b"0.3655mm"])
def test_digits_of_a_display_that_are_fixed(reply):
    good = {"integer_digits": 1, "decimals": 3}
    once = (b"?\r", reply + b"\r\n")
    with dialogue(*START, once, *((once, once, *CHECKED) if reply == b"1.365mm" else ())) as link:
        if reply == b"1.365mm":
            assert optorsd(link, **good).read().value == pytest.approx(1.365e-3)
        else:
            with pytest.raises(Garbled, match="digits"):
                optorsd(link, **good).read()


def test_silence_says_what_to_look_at():
    with dialogue(*START, (b"?\r", b"")) as link, pytest.raises(NoReply, match=r"menu open.*master measurement"):
        optorsd(link).read()


def test_half_a_line_is_no_reading():
    with dialogue(*START, (b"?\r", b"0.365m")) as link, pytest.raises(NoReply, match=r"only '0\.365m'"):
        optorsd(link).read()


def test_bytes_that_came_unasked_are_no_answer():
    """The DATA key was pressed: its value must not be taken for the answer to the next question."""
    data = b"0.365mm\r\n0.111mm\r\n"
    with dialogue(*START, (b"?\r", data)) as link, pytest.raises(Garbled, match="unasked"):
        optorsd(link).read()


def test_a_new_session_drops_what_lies_on_the_line():
    value = (b"?\r", b"0.100mm\r\n")
    with dialogue((b"", b"0.999mm\r\n"), *START, value, value, value, *CHECKED) as link:
        assert optorsd(link).read().value == pytest.approx(1e-4)
        assert b"dropped" in b"".join(t.way.encode() for t in link.take_transcript())


def test_after_an_error_everything_is_set_again():
    value = (b"?\r", b"0.100mm\r\n")
    with dialogue(*START, (b"?\r", b"OV\r\n"), *START, value, value, value, *CHECKED) as link:
        gauge = optorsd(link)
        with pytest.raises(OverRange):
            gauge.read()
        assert gauge.read().value == pytest.approx(1e-4)


def test_a_value_with_blanks_before_its_sign():
    values = [(b"?\r", b"  -0.365mm\r\n")] * 3
    with dialogue(*START, *values, *CHECKED) as link:
        assert optorsd(link).read().value == pytest.approx(-0.365e-3)


def test_digits_before_the_point_are_not_left_open_alone():
    """A lost leading digit shows in them only."""
    with pytest.raises(ValueError, match="both or neither"):
        OptorsSettings(protocol="OPTORSS", unit="um", range_mm=[-1.0, 1.0], decimals=3)


WHO_M = (b"I\r", b"I,MAHRGMBH,C1216,V1.02 \r")  # with the blank of page 67
P86 = {"mm": (b"P86,1\r", b"\r"), "in": (b"P86,2\r", b"\r"), "um": (b"P86,3\r", b"\r")}


def m(text: bytes) -> tuple[bytes, bytes]:
    return b"M\r", b"M1, " + text + b"\r"


@pytest.mark.parametrize(
    ("unit", "shown", "other", "shown_there", "metres"),
    [
        ("mm", b"0.3650", "um", b"365.1", 0.365e-3),
        ("in", b"-0.01000", "um", b"-254.0", -254e-6),
        ("um", b" 254.0", "mm", b" 0.2540", 254e-6),
        ("um", b"0.0", "mm", b"0.0000", 0.0),  # other decimals show that the display obeys
    ],
)
def test_m1240_takes_every_value_in_two_units(unit, shown, other, shown_there, metres):
    once = (P86[unit], m(shown))
    with dialogue(WHO_M, *once, P86[other], m(shown_there), *once, WHO_M) as link:
        assert m1240(link, unit=unit).read().value == pytest.approx(metres)


@pytest.mark.parametrize("shown", [b"-12.300", b"0.000", b"-0.484", b"0.0001"])
def test_m1240_a_unit_that_is_not_obeyed(shown):
    """A locked panel: the same number in both units. Near zero, too, where both numbers agree."""
    for how, reply in (("cr", b"\r"), ("none", b"")):
        um, mm = ((P86[unit][0], reply) for unit in ("um", "mm"))
        steps = (WHO_M, um, m(shown), mm, m(shown), um, m(shown))
        with dialogue(*steps) as link, pytest.raises(Implausible):
            m1240(link, unit="um", acknowledged=how, range_mm=[-20.0, 20.0]).read()


def test_m1240_a_unit_that_stays_without_an_answer():
    with dialogue(WHO_M, (b"P86,1\r", b"")) as link, pytest.raises(NoReply, match="acknowledged = 'none'"):
        m1240(link).read()


def test_m1240_several_values():
    mm, um = (b"M\r", b"M1, 0.2540\rM2, 1.0000\r"), (b"M\r", b"M1, 254.0\rM2, 1000.0\r")
    with dialogue(WHO_M, P86["mm"], mm, P86["um"], um, P86["mm"], mm, WHO_M) as link:
        assert m1240(link, features=2).read().value == pytest.approx(254e-6)
    with dialogue(WHO_M, P86["mm"], mm) as link, pytest.raises(Garbled, match="unasked"):
        m1240(link).read()


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
    with dialogue(WHO_M, P86["mm"], (b"M\r", reply)) as link, pytest.raises(error):
        m1240(link).read()


def test_m1240_a_unit_that_is_not_acknowledged():
    with dialogue(WHO_M, (b"P86,1\r", b"ERR1\r")) as link, pytest.raises(InstrumentRefused):
        m1240(link).read()
