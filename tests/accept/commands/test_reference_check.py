"""The daily reference: what no protocol tells is found by an artefact, and a spec can ask for it."""

import json
from datetime import UTC, date, datetime, timedelta
from functools import partial

import pytest

from accept.capture.reference_check import CHECKED, ReferenceCheck, days_checked, history, keep
from accept.commands.bench import check as command
from accept.judging import calibration, load_spec
from accept.store import open_store
from hw.instruments import open_instrument
from specs.bench import load_bench
from tests.accept.units.units import make_unit
from tests.hw.peers.heidenhain import HeidenhainPeer
from tests.hw.peers.line import Line
from tests.hw.peers.network import served
from tests.hw.peers.scpi_lcr import E4980aPeer
from tests.shared import command_line

run = partial(command_line.accept, columns=160)
LCR = """name = "bench 1"
[instruments.lcr]
driver = "scpi_lcr"
measures = ["capacitance"]
serial = "MY46412345"
resource = "TCPIP::{host}::{number}::SOCKET"
settings = {{ profile = "keysight", timeout_s = 1.0, quiet_s = 0.05 }}
accuracy = {{ U_percent = 0.2, source = "manual" }}
calibration = {{ certificate = "K-1", due = 2099-01-01 }}
[instruments.lcr.reference]
what = "10 uF standard"
value = 10.003
unit = "uF"
U = 0.004
certificate = "C-77"
"""
GAUGE = """name = "bench 1"
[instruments.probe]
driver = "nd287"
measures = ["flatness"]
link = { port = "/dev/x", baud = 9600, data_bits = 7, parity = "even", stop_bits = 2, handshake = "none" }
settings = { axis = "single", range_mm = [-13.0, 13.0] }
accuracy = { U = 0.4, source = "manual" }
reference = { what = "step block", value = 100.0, unit = "um", U = 0.2, certificate = "S-1" }
[instruments.scale]
driver = "offline"
measures = ["stiffness"]
serial = "W1"
accuracy = { U = 0.002, source = "manual" }
reference = { what = "5 kg mass", value = 5.0, unit = "kg", U = 0.0005, certificate = "M-1" }
"""


def stored() -> list[dict]:
    with open_store() as store:
        return [dict(event.data) for event in store.events(what=CHECKED)]


@pytest.mark.parametrize(("scale", "code"), [(1.0, 0), (1.0015, 0), (1.004, 3), (0.5, 3)])
def test_a_meter_against_a_standard(scale, code, tmp_path):
    """Its accuracy is 0.2 %, 0.02 uF: 0.15 % off passes, 0.4 % does not."""
    peer = E4980aPeer()
    peer.truth = 10.003e-6 * scale
    with served(peer) as where:
        host, number = where.split(":")
        (tmp_path / "bench.toml").write_text(LCR.format(host=host, number=number))
        words = ("hw", "check", "lcr", "--bench", tmp_path / "bench.toml", "--in-place", "--json", tmp_path / "c.json")
        done = run(*words)
    assert done.exit_code == code, done.output
    found = json.loads((tmp_path / "c.json").read_text())
    assert found["value"] == pytest.approx(10.003 * scale, rel=1e-5)  # six digits of the meter
    assert found["E_n"] == pytest.approx((found["value"] - 10.003) / (0.004**2 + (0.002 * found["value"]) ** 2) ** 0.5)
    assert found["passed"] is (code == 0)
    (event,) = stored()
    assert event["certificate"] == "C-77"
    assert any(way == "sent" and "FETC" in text for _, way, text in event["evidence"]["transcript"])
    assert len(found["history"]) == 1


@pytest.mark.parametrize(("scaling", "code"), [(1.0, 0), (2.0, 3)])
def test_a_scaling_that_a_readout_does_not_tell_is_found(scaling, code, tmp_path, monkeypatch):
    peer = HeidenhainPeer()
    heights = {"beside": 1.2345e-3, "on": 1.2345e-3 + scaling * 100e-6}  # its zero is anywhere

    def opened(name, entry, ask):
        line = Line(peer)
        instrument = open_instrument(name, entry, ask)
        instrument.link._opener, instrument.link.clock = line.open, line.clock
        return instrument

    def technician(words: str) -> str:
        peer.truth = heights["beside" if "beside" in words else "on"]
        return ""

    monkeypatch.setattr(command, "open_instrument", opened)
    monkeypatch.setattr(command, "ask_at_terminal", technician)
    (tmp_path / "bench.toml").write_text(GAUGE)
    assert run("hw", "check", "probe", "--bench", tmp_path / "bench.toml").exit_code == code
    (event,) = stored()
    assert event["value"] == pytest.approx(scaling * 100.0, abs=0.2)  # twice the last digit of the display


def test_a_scale_without_a_wire_is_read_by_a_person(tmp_path, monkeypatch):
    (tmp_path / "bench.toml").write_text(GAUGE)
    answers = iter(["5.0011", "5.0009", "5.0010", "5,1"])
    monkeypatch.setattr(command, "ask_at_terminal", lambda _: next(answers))
    assert run("hw", "check", "scale", "--bench", tmp_path / "bench.toml").exit_code == 0
    assert run("hw", "check", "scale", "--bench", tmp_path / "bench.toml").exit_code == 6
    assert len(stored()) == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('accuracy = { U = 0.002, source = "manual" }', ""), "accuracy is missing"),
        (('certificate = "M-1" }', 'certificate = "M-1", due = 2020-01-01 }'), "has expired"),
        (("[instruments.scale]", "[instruments.other]"), "has no instrument 'scale'"),
        (("U = 0.0005", "U = 0"), "greater than 0"),
    ],
)
def test_what_no_comparison_can_rest_on_is_bad_input(change, words, tmp_path):
    (tmp_path / "bench.toml").write_text(GAUGE.replace(*change))
    done = run("hw", "check", "scale", "--bench", tmp_path / "bench.toml")
    assert done.exit_code == 6
    assert words in done.output
    assert stored() == []


def check_of(day: date, E_n: float, serial: str = "MY46412345") -> ReferenceCheck:
    return ReferenceCheck(
        "lcr", serial, f"{day}T08:00:00+00:00", "std", "C", "uF", 10.0, 0.004, 10.0 + 0.02 * E_n, 0.0196, ()
    )


TODAY = datetime.now(UTC).date()


@pytest.mark.parametrize(
    ("comparisons", "words"),
    [
        ([], "never compared"),
        ([(0, 0.3)], None),
        ([(1, 0.3)], None),
        ([(2, 0.3)], "last compared with its reference"),
        ([(1, 0.3), (0, 2.0)], "missed its reference"),
        ([(1, 2.0), (0, 0.3)], None),
        ([(-1, 0.3)], "never compared"),  # afterwards
    ],
)
def test_a_spec_that_asks_for_it_passes_nothing_without(comparisons, words, tmp_path):
    (tmp_path / "bench.toml").write_text(LCR.format(host="h", number=1))
    bench = load_bench(tmp_path / "bench.toml")
    with open_store() as store:
        for days, E_n in comparisons:
            keep(store, check_of(TODAY - timedelta(days), E_n), {}, "Ann")
        keep(store, check_of(TODAY, 0.1, serial="OTHER"), {}, "Ann")  # another meter that stood at its place
        references = days_checked(store, bench)
        assert len(history(store.events(what=CHECKED), "lcr", "MY46412345")) == len(comparisons)
    asked = load_spec("apa").checks["capacitance"].model_copy(update={"reference_days": 1})
    stated = calibration.statement(bench, {"capacitance": asked}, TODAY, None, references)
    held = calibration.checked_calibration(stated, {})
    problems = calibration.problems(held, ["capacitance"])
    assert (words in str(problems["capacitance"])) if words else problems == {}
    assert calibration.checked_calibration(held, {}) == held  # as a verification judges it again, without the store
    assert calibration.same_calibration(held, calibration.checked_calibration({**stated}, {}))


def test_a_spec_that_does_not_ask_says_what_it_said_before(tmp_path):
    (tmp_path / "bench.toml").write_text(LCR.format(host="h", number=1))
    checks = {"capacitance": load_spec("apa").checks["capacitance"]}
    stated = calibration.statement(load_bench(tmp_path / "bench.toml"), checks, TODAY)
    (row,) = calibration.checked_calibration(stated, {})["instruments"]
    assert not {"reference", "references", "reference_days"} & set(row)


def test_a_batch_takes_the_comparisons_from_the_store(tmp_path):
    make_unit(tmp_path / "units" / "APA-01")
    (tmp_path / "bench.toml").write_text(LCR.format(host="h", number=1))
    assert run("spec", "copy", "apa-basic", tmp_path / "s.toml").exit_code == 0
    text = (tmp_path / "s.toml").read_text()
    (tmp_path / "s.toml").write_text(
        text.replace("[checks.capacitance]\n", "[checks.capacitance]\nreference_days = 1\n")
    )
    assert "reference_days" in (tmp_path / "s.toml").read_text()

    def problem() -> str | None:
        out = tmp_path / "out"
        words = ("--spec", tmp_path / "s.toml", "--bench", tmp_path / "bench.toml", "--no-certificates")
        run("batch", tmp_path / "units", "--out", out, *words)
        (unit,) = json.loads((out / "results.json").read_text())["units"]
        return unit["calibration"]["instruments"][0]["problem"]

    assert "never compared" in str(problem())
    with open_store() as store:
        keep(store, check_of(TODAY, 0.3), {}, "Ann")
    assert problem() is None


def test_a_spec_that_asks_for_it_passes_nothing_without_a_bench_file(tmp_path):
    """What is asked stands in the spec: without --bench, or without the days in a row, nothing is stated."""
    make_unit(tmp_path / "units" / "APA-01")
    assert run("spec", "copy", "apa-basic", tmp_path / "s.toml").exit_code == 0
    text = (tmp_path / "s.toml").read_text()

    def verdicts() -> dict[str, str]:
        run("batch", tmp_path / "units", "--out", tmp_path / "o", "--spec", tmp_path / "s.toml", "--no-certificates")
        (unit,) = json.loads((tmp_path / "o" / "results.json").read_text())["units"]
        return {f["check"]: f["verdict"] for f in unit["findings"]}

    assert set(verdicts().values()) == {"pass"}
    (tmp_path / "s.toml").write_text(
        text.replace("[checks.capacitance]\n", "[checks.capacitance]\nreference_days = 1\n")
    )
    found = verdicts()
    assert found.pop("capacitance") == "conditional"
    assert set(found.values()) == {"pass"}

    asked = {"capacitance": load_spec("apa").checks["capacitance"].model_copy(update={"reference_days": 1})}
    (tmp_path / "bench.toml").write_text(LCR.format(host="h", number=1))
    bench = load_bench(tmp_path / "bench.toml")
    kept = {"lcr": [(TODAY.isoformat(), 0.1)]}
    stated = calibration.checked_calibration(calibration.statement(bench, asked, TODAY, None, kept), {})
    assert calibration.without_reference(stated, asked) == {}
    silent = {key: value for key, value in stated["instruments"][0].items() if not key.startswith("reference")}
    assert set(calibration.without_reference({**stated, "instruments": [silent]}, asked)) == {"capacitance"}
    looser = {**stated["instruments"][0], "reference_days": 9999}
    assert set(calibration.without_reference({**stated, "instruments": [looser]}, asked)) == {"capacitance"}
