"""Simulated units: exact in time, true to the model, judged as what was put in, the same every time."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.base.documents.results import UnitRecord
from accept.certificate import CertificateContent, InvalidCertificate
from accept.certificate.verify import rejudge
from accept.cli.main import app
from accept.judging import judge_unit, load_spec
from accept.judging.advice import first_advice
from accept.models.model_file import open_model
from accept.simulate import FAULTS, UnitRequest, UnitRequestError, simulate, write
from accept.simulate import demo as demo_unit
from accept.simulate.apa import heights
from accept.simulate.converters import LSB_V, Converters
from accept.simulate.records import DrivenUnit, axial_Hz, noise_record, slow_record
from accept.simulate.unit_request import drawn
from accept.units import unit_folder as units
from checks.acceptance import CHECKS, POSITIONS_MM, minimum_zone
from checks.cause import Cause
from checks.gap import EFFECTS, with_effects
from checks.gap.effects import Parameter
from checks.model import Model, frequency_and_damping, time_simulation
from checks.model.time.hysteresis_creep import creep
from checks.model.time.partial_fractions import real_pole
from checks.model.time.time_response import HoldSimulation
from checks.record import Record
from checks.signals.slow.loops import last_cycles
from checks.signals.spectral.lpm import lpm
from checks.verdict import Finding
from tests.checks.model.units_model import EVERYTHING, MISALIGNED
from tests.soak import SOAK

SHORT = 10.5  # the specs ask for 10 s


@pytest.fixture(scope="module")
def strut() -> Model:
    return open_model("strut")


@pytest.fixture(scope="module")
def apa() -> Model:
    return open_model("apa-frame").with_values({"bench.payload_kg": 5.0})


def order(model: Model, kind: str = "strut", **changes: Any) -> UnitRequest:
    made = UnitRequest("T-1", kind, model, 1, repeats=False, low_s=SHORT, high_s=SHORT, compact=False)
    made = replace(made, effects=(MISALIGNED,)) if kind == "strut" else made
    return replace(made, **changes)


def judged(of: UnitRequest, folder: Path) -> UnitRecord:
    write(simulate(of), folder)
    return judge_unit(units.read(folder), load_spec(of.kind))


# --- records


@pytest.mark.parametrize("effects", [(MISALIGNED,), tuple(EVERYTHING)], ids=["good", "everything"])
@pytest.mark.parametrize(("high", "lo", "hi"), [(False, 5.0, 350.0), (True, 350.0, 2000.0)])
def test_measured_responses_are_the_model_within_noise(
    strut: Model, effects: tuple[Any, ...], high: bool, lo: float, hi: float
) -> None:
    """Steps of converters and encoder and noise of sensors are all that is between them, and the estimator says how
    much that is: squared distance over its variance has median ln 2 and mean one over independent bins, more by what
    the estimated variance scatters (17 degrees of freedom) and the local polynomials leave at the sharpest peaks."""
    bench = DrivenUnit(order(strut, effects=effects, low_s=20.0, high_s=20.0), with_effects(strut, effects))
    record = noise_record(bench, "x", high)
    found = lpm(record["Va"], {c: record[c] for c in strut.channels}, 1e4, f_lo=lo, f_hi=hi, step=17)
    z = np.abs(found.H - bench.model.frf(found.f)) ** 2 / found.var
    assert np.all((np.median(z, axis=0) > 0.45) & (np.median(z, axis=0) < 0.95))
    assert np.all((z.mean(axis=0) > 0.8) & (z.mean(axis=0) < 1.4))


def test_converters_step_and_end() -> None:
    c, rng = Converters(), np.random.default_rng(0)
    V = c.dac(np.array([0.1, 11.0, -11.0]))
    assert V[0] == pytest.approx(0.1, abs=LSB_V / 2)
    assert V[1] == 10.0 - LSB_V
    assert V[2] == -10.0
    de = c.read("de", np.linspace(0, 1e-6, 1000), rng) / 2.5e-9
    np.testing.assert_allclose(de, np.round(de), atol=1e-9)
    quiet = c.noisier(0.0).read("Vs", np.zeros(10), rng)
    assert not quiet.any()


def test_hysteresis_of_the_drive_is_in_every_channel(strut: Model) -> None:
    bench = DrivenUnit(order(strut, effects=(MISALIGNED, ("hysteresis", {"relative_width": 0.12}))), strut)
    record = slow_record(bench, "x")
    spec = load_spec("strut").checks["hysteresis"]
    made = Record(record["t"], {c: record[c] for c in ("Va", "Vs", "de")}, {"Va": "V", "Vs": "V", "de": "m"})
    outcome = CHECKS["hysteresis"].measure({"record": made}, spec)
    found = {q.name: q for q in outcome.quantities}
    assert found["hysteresis_percent"].value == pytest.approx(12.0, abs=0.05)  # 120 plays, converter steps
    assert len(last_cycles(record["Va"])) == 6
    assert found["sensor_hysteresis_percent"].value == pytest.approx(12.0, abs=1.5)  # Vs: 1 mV of noise in 1.8 V


@pytest.mark.parametrize("hold", [False, True])
def test_creep_of_the_drive_is_in_the_records(strut: Model, hold: bool) -> None:
    """A slow sine sees the relaxations by their factor; it is well away from one."""
    share = creep(0.02)
    t = np.arange(20_000) / 1e4
    Va = np.sin(2 * np.pi * 5.0 * t)
    plain, crept = (time_simulation(strut, t.size, 1e4, hold, ("da",), f)(Va)["da"] for f in ({}, {"da": share}))
    factor = share.at(np.array([2j * np.pi * 5.0]))[0]
    late = t > 1.0
    basis = np.column_stack([np.sin(2 * np.pi * 5.0 * t), np.cos(2 * np.pi * 5.0 * t), np.ones_like(t), t])[late]
    one, two = (np.linalg.lstsq(basis, y[late], rcond=None)[0][:2] @ [1.0, 1j] for y in (plain, crept))
    assert two / one == pytest.approx(factor, abs=3e-4)  # the slow relaxations have not yet settled


@pytest.mark.parametrize("hold", [False, True])
def test_a_filter_is_in_the_path_of_its_channels_alone(
    strut: Model, hold: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Red before: it was put before the model, in every channel."""
    slow = replace(
        EFFECTS["creep"],
        name="slow_encoder",
        channels=("de",),
        parameters=(Parameter("f_Hz", lo=1.0, hi=1e5, off=np.inf, start=100.0, scale=10.0),),
        path=lambda values: real_pole(2 * np.pi * values["f_Hz"]),
    )
    monkeypatch.setitem(EFFECTS, slow.name, slow)
    hidden = (("slow_encoder", {"f_Hz": 50.0}),)
    plain, filtered = (DrivenUnit(order(strut, effects=e, hold=hold), strut).answer(2000, 1e4) for e in ((), hidden))
    f = np.arange(1, 40) * 25.0
    for i, channel in enumerate(strut.channels):
        if isinstance(plain, HoldSimulation):
            one, two = (each.paths[channel].at(2j * np.pi * f) for each in (plain, filtered))
        else:
            f = np.fft.rfftfreq(plain.size, 1e-4)[1:]
            one, two = (each.H[1:, i] for each in (plain, filtered))
        # sums over some ten poles are good for 1e-9
        np.testing.assert_allclose(two / one, 1 / (1 + 1j * f / 50.0) if channel == "de" else 1.0, rtol=1e-9)


# --- whole units


def test_a_good_strut_is_accepted_and_told_right(strut: Model, tmp_path: Path) -> None:
    result = judged(order(strut), tmp_path)
    assert (result.verdict, first_advice(result.findings)) == ("accepted", None)
    found = {f.quantity: f for f in result.findings}
    f, _ = frequency_and_damping(with_effects(strut, [MISALIGNED]).poles())
    for name in ("axial_resonance_Hz", "x_bending_Hz", "y_bending_Hz"):
        assert np.abs(f - found[name].value).min() < 2 * found[name].U  # U is k = 2: beyond it twice is a mistake


def test_a_good_apa_is_accepted_and_told_right(apa: Model, tmp_path: Path) -> None:
    result = judged(order(apa, "apa"), tmp_path)
    assert (result.verdict, first_advice(result.findings)) == ("accepted", None)
    figures = json.loads((tmp_path / "truth.json").read_text())["figures"]
    found = {f.quantity: f for f in result.findings} | {i.quantity: i for i in result.information}
    x_bending, y_bending, _, torsion = figures["modes_Hz"]
    truth = {
        "flatness_um": figures["flatness_um"],
        "stroke_um": figures["stroke_um"],
        "k_closed_N_per_um": figures["k_closed_N_per_um"],
        "k_open_N_per_um": figures["k_open_N_per_um"],
        "sensor_highpass_Hz": figures["sensor_highpass_Hz"],
        "x_bending_Hz": x_bending,
        "y_bending_Hz": y_bending,
        "z_torsion_Hz": torsion,
        "axial_resonance_Hz": axial_Hz(apa),
        "creep_per_decade_percent": 100 * figures["creep"],
        "x_bending_damping_percent": 100 * figures["damping_ratio"],
    }
    # where U shows scatter alone: how the mass rings and how neighbouring modes lean on one another
    shape = {"creep_per_decade_percent": 0.01, "x_bending_damping_percent": 1e-3}
    for name, value in truth.items():
        # 1.5 U: of eleven, one beyond its U (k = 2) is no surprise
        assert abs(found[name].value - value) < 1.5 * found[name].U + shape.get(name, 0.0) * value, name
    assert found["hysteresis_percent"].value == pytest.approx(100 * figures["loop"], abs=0.1)


FIRST = {  # what is said first about each fault: the right action
    "flatness": "clean both faces",
    "capacitance": "leads are on the right stacks",
    "dead_stack": "all three stacks",
    "soft": "weigh the added mass",
    "soft_bending": "check the clamping",
    "hysteresis": "let the amplifier warm up",
    "double_hit": "hit once, briefly",
    "wrong_payload": "check the payload",
    "polarity": "reverse the connection of sensor stack Vs",
    "exchanged": "exchange the plugs of encoder de and interferometer da",
    "offset": "check the acquisition settings",
    "dead_encoder": "check plug and supply of encoder de",
    "dead_sensor": "check plug and supply of sensor stack Vs",
    "clipped": "set the range of sensor stack Vs higher",
    "truncated": "copy, correct or export the file again",
}

# Beside the heavy lane one of each kind: of the part, of a stack, of the drive, of an experiment, of a channel, of a
# file. A wrong payload is judged in test_bench_errors.py.
QUICK = ("flatness", "dead_stack", "hysteresis", "double_hit", "exchanged", "truncated")


def faults_of(kind: str) -> list[str]:
    """The faults of a kind of unit. What both kinds can have is done to the same records by the same code: beside the
    heavy lane to an APA only."""
    own = [name for name, fault in FAULTS.items() if kind in fault.kinds]
    return own if SOAK else [n for n in own if n in QUICK and (kind == "apa" or len(FAULTS[n].kinds) == 1)]


@pytest.mark.parametrize("kind", ["apa", "strut"])
@pytest.mark.slow
def test_every_fault_is_found_and_nothing_else(kind: str, apa: Model, strut: Model, tmp_path: Path) -> None:
    for name in faults_of(kind):
        result = judged(order(apa if kind == "apa" else strut, kind, fault=name), tmp_path / name)
        shown = {(f.quantity, str(f.verdict)) for f in result.findings}
        expected = FAULTS[name].shown(kind)  # the gap analysis is not run here
        assert set(expected) <= shown, name
        # a section without a result has none for all of its findings; no other section is touched, but by what the
        # spoilt one contradicts, as a stroke with a dead stack and responses of a sound one
        sections = {CHECKS[f.check].reads for f in result.findings if (f.quantity, str(f.verdict)) in expected}
        alone = [f for f in result.findings if f.verdict != "pass" and not only_contradicted(f)]
        assert {CHECKS[f.check].reads for f in alone} == sections, name
        assert str(first_advice(result.findings)).partition("; ")[0].count(FIRST[name]) == 1, name


def only_contradicted(finding: Finding) -> bool:
    return finding.cause is not None and [r.cause for r in finding.cause.all()] == [Cause.CONTRADICTION]


def test_equal_orders_give_equal_bytes_and_other_seeds_others(strut: Model) -> None:
    one, again, other = (simulate(order(strut, seed=seed)) for seed in (1, 1, 2))
    assert dict(one.files) == dict(again.files)
    assert one.truth == again.truth
    assert all(one.files[n] != other.files[n] for n in one.files if n.startswith("frf"))


def test_repeats_are_other_realisations(strut: Model) -> None:
    files = simulate(order(strut, repeats=True)).files
    assert files["frf_noise.mat"] != files["frf_noise_2.mat"]
    assert files["frf_noise_hf.mat"] != files["frf_noise_hf_2.mat"]


def test_measured_data_are_never_replaced(strut: Model, tmp_path: Path) -> None:
    (tmp_path / "unit.toml").write_text('serial = "REAL"\n')
    with pytest.raises(UnitRequestError, match="not simulated"):
        write(simulate(order(strut)), tmp_path)
    assert (tmp_path / "unit.toml").read_text() == 'serial = "REAL"\n'


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"serial": "a/b"}, "a/b"),
        ({"kind": "apa"}, "has joints"),
        ({"fault": "flatness"}, "a unit of kind strut can have"),
        ({"low_s": 0.1}, "0.1 s"),
        ({"seed": -1}, "-1"),
        ({"effects": (("hysteresis", {"width": 0.1}),)}, "relative_width"),
    ],
)
def test_impossible_orders_are_refused(strut: Model, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(UnitRequestError, match=words):
        simulate(order(strut, **changes))


def test_drawn_parameters_stay_near_their_priors(strut: Model) -> None:
    c = strut.calibrated
    rows = np.array([[drawn(strut, seed).values[n] for n in c.names] for seed in range(200)])
    assert np.all(np.abs(rows - c.values) <= 2.0 * c.sds + 1e-12)
    # the spread of 200 draws is known to 5 %; clipping at two takes 4 % off; cR is held above zero
    free = [n != "joint.cR_Nm_s_per_rad" for n in c.names]
    np.testing.assert_allclose((rows.std(axis=0) / c.sds)[free], 0.95, atol=0.2)
    assert drawn(strut, 7).values == drawn(strut, 7).values


def test_heights_are_as_flat_as_asked() -> None:
    x, y = np.array(POSITIONS_MM).T
    z = np.array(heights(np.random.default_rng(2), 5.0))
    # mm and um in one: tilts of up to 1 um/mm do not matter; probe steps of 0.5 um move the zone by a quarter at most
    assert minimum_zone(x, y, z / 1e3).half_width * 1e3 == pytest.approx(5.0, abs=0.3)


# --- the demo


def test_the_demo_trusts_its_own_strut_and_no_altered_one(tmp_path: Path) -> None:
    strut, spec = demo_unit.demo_strut(), load_spec("strut-basic")  # by which the demo judges
    result = judge_unit(units.read(write(strut, tmp_path / "unit")), spec).to_json()
    own = CertificateContent(result, spec.name, spec.title, spec.text, "Ann", files=strut.files)
    assert rejudge.rejudge_demo(own).verdict == "accepted"
    altered = dict(strut.files)
    altered["hysteresis.mat"] = altered["frf_noise.mat"]
    with pytest.raises(InvalidCertificate, match="not a unit of the demo"):
        rejudge.rejudge_demo(replace(own, files=altered))
    with pytest.raises(InvalidCertificate, match="the attached result cannot be read"):
        rejudge.rejudge_demo(replace(own, result={}))


# --- the command line


def run(*words: object) -> Any:
    return CliRunner().invoke(app, [str(w) for w in words])


def test_command_line(tmp_path: Path) -> None:
    model = tmp_path / "mine.toml"
    builtin = Path(__file__).parents[3] / "specs" / "models" / "strut.toml"
    slow = '[[effects]]\nname = "hysteresis"\nrelative_width = 0.05\n'
    model.write_text(builtin.read_text() + slow)
    done = run(
        "simulate", "unit", "--out", tmp_path / "U", "--model", model, "--dx-um", 20, "--effect",
        "bench_mode:f_Hz=110,ratio=0.02,damping_ratio=0.01", "--set", "joint.kz_N_per_um=80", "--draw", "--noise", 2,
        "--low-s", 4, "--high-s", 4, "--no-repeats", "--hold", "--serial", "U-7",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    truth = json.loads((tmp_path / "U" / "truth.json").read_text())
    assert [e["name"] for e in truth["effects"]] == ["hysteresis", "bench_mode", "misalignment"]
    assert truth["parameters"]["joint.kz_N_per_um"] == 80.0
    assert truth["parameters"]["misalignment.dx_um"] == 20.0
    assert truth["noise"]["Vs"] == 2e-3
    assert units.read(tmp_path / "U").serial == "U-7"


@pytest.mark.parametrize(
    "words",
    [
        ["--kind", "wing"],
        ["--effect", "foo:a=1"],
        ["--effect", "bench_mode:f_Hz"],
        ["--effect", "misalignment:dx_um=1,dy_um=2", "--dx-um", "3"],
        ["--fault", "soft"],
        ["--set", "joint.kz_N_per_um=-3"],
        ["--set", "joint.nothing=3"],
        ["--model", "nothing"],
        ["--low-s", "nan"],
    ],
)
def test_bad_input_is_one_clear_line(words: list[str], tmp_path: Path) -> None:
    done = run("simulate", "unit", "--out", tmp_path / "U", *words)
    assert done.exit_code == 6, done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "U").exists()


def test_faults_are_listed() -> None:
    done = run("simulate", "faults")
    assert done.exit_code == 0
    assert all(name in done.output for name in FAULTS)
