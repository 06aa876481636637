"""Which file of a folder is proposed for which input: by its channels, its name, its age."""

import os
import time
from pathlib import Path

import pytest

from accept.workflow.entry.record_folder import age_words, proposals
from checks.acceptance import CHECKS
from checks.declare import CsvTable, Series

AGO_S = 100.0  # long enough ago for a file to be whole


def written(folder: Path, *names: str, ago: float = AGO_S) -> None:
    for name in names:
        (folder / name).write_text("x")
        os.utime(folder / name, (time.time() - ago,) * 2)


def proposed(folder: Path, check: str, form: str = "records", taken=(), fits=lambda *_: True) -> dict[str, str]:
    found = next(f for f in CHECKS[check].forms if f.name == form)
    wanted = [i for i in found.inputs if isinstance(i, Series | CsvTable)]
    shown = proposals(folder, wanted, check, fits, lambda path, _: path.name in taken)
    return {name: file.name for name, file in shown.items()}


@pytest.mark.parametrize(
    ("check", "expected"),
    [
        ("stroke", {"one_stack": "stroke_one_stack.mat", "two_stacks": "stroke_two_stacks.mat"}),
        ("stiffness", {"closed_circuit": "add_mass_closed_circuit.mat", "open_circuit": "add_mass_open_circuit.mat"}),
        ("sensor_highpass", {"with_resistor": "sweep_lf_with_R.mat", "without_resistor": "sweep_lf.mat"}),
        ("frf", {"low": "frf_noise.mat", "high": "frf_noise_hf.mat"}),
        (
            "spurious_modes",
            {
                "x_bending": "bending_X_top.mat",
                "y_bending": "bending_Y_top.mat",
                "torsion_left": "torsion_left.mat",
                "torsion_top": "torsion_top.mat",
            },
        ),
    ],
)
def test_names_as_laboratories_give_them_find_their_inputs(check: str, expected: dict[str, str], tmp_path: Path):
    for n, name in enumerate(sorted(expected.values())):
        written(tmp_path, name, ago=AGO_S + n)
    assert proposed(tmp_path, check) == expected


def test_the_newest_of_those_that_say_nothing_is_proposed_first(tmp_path: Path):
    written(tmp_path, "rec_1.mat", ago=300)
    written(tmp_path, "rec_9.mat", ago=AGO_S)
    assert proposed(tmp_path, "stroke")["one_stack"] == "rec_9.mat"


def test_a_file_of_today_comes_before_an_old_one_with_a_better_name(tmp_path: Path):
    written(tmp_path, "hysteresis.mat", ago=30 * 86400)
    written(tmp_path, "rec_9.mat")
    assert proposed(tmp_path, "hysteresis", "record") == {"record": "rec_9.mat"}


def test_what_lacks_the_channels_was_taken_or_is_being_written_is_not_proposed(tmp_path: Path):
    written(tmp_path, "a.mat")
    assert proposed(tmp_path, "hysteresis", "record", fits=lambda *_: False) == {}
    assert proposed(tmp_path, "hysteresis", "record", taken=("a.mat",)) == {}
    written(tmp_path, "a.mat", ago=0)
    assert proposed(tmp_path, "hysteresis", "record") == {}
    assert proposed(tmp_path / "gone", "hysteresis", "record") == {}


def test_an_optional_input_wants_a_name_that_speaks_for_it(tmp_path: Path):
    written(tmp_path, "frf_noise.mat", "frf_noise_hf.mat", "frf_noise_2.mat", "other.mat")
    found = proposed(tmp_path, "frf")
    assert found["low_repeat"] == "frf_noise_2.mat"
    assert not {"first", "without_encoder_low"} & set(found)


def test_an_age_is_read_at_a_glance():
    assert age_words(100.0, 110.0) == "10 s ago"
    assert age_words(0.0, 600.0) == "10 min ago"
