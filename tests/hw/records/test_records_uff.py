"""Universal files of frequency response functions: written ones as pyuff reads them, and pyuff's as read here."""

import warnings

import numpy as np
import pytest
import pyuff

from checks.errors import RecordError
from hw.records import list_channels
from hw.records.uff import write as uff
from tests.hw.records.read_uff import read_frf

UNITS = {"de": "m", "Vs": "V", "Va": "V"}
AXES = {
    "even": np.arange(1, 4000) * 0.5,
    "even, 5120/8192 Hz": np.arange(0, 2000) * 0.625,
    "even, a third": np.arange(0, 3000) / 3,
    "uneven": np.geomspace(1.0, 2000.0, 777),
}
# 13 digits in the values; 7 in a stated frequency, in the first and in the step.
H_DIGITS, F_DIGITS = 5e-13, 6e-7


def plant(f: np.ndarray) -> np.ndarray:
    """(F, 2) of a resonance at 95 Hz in de and its force in Vs."""
    s = 2j * np.pi * np.maximum(f, 1e-3)
    x = 1e-5 * 597**2 / (s**2 + 2 * 0.01 * 597 * s + 597**2)
    return np.column_stack([x, 1e5 * x * np.exp(-1e-4 * s)])


@pytest.mark.parametrize("axis", list(AXES))
def test_written_functions_read_back_here_and_by_pyuff(axis, tmp_path):
    f = AXES[axis]
    H, path = plant(f), tmp_path / "a.uff"
    path.write_bytes(uff.frf_bytes(f, H, ["de", "Vs"], "Va", UNITS))
    found = read_frf(path)
    assert (found.channels, found.input_name, found.units) == (("de", "Vs"), "Va", UNITS)
    np.testing.assert_allclose(found.f, f, rtol=F_DIGITS)
    np.testing.assert_allclose(found.H.view(float), H.view(float), rtol=H_DIGITS)
    for i, name in enumerate(("de", "Vs")):
        theirs = pyuff.UFF(str(path)).read_sets(i)
        assert (theirs["func_type"], theirs["rsp_ent_name"], theirs["ref_ent_name"]) == (4, name, "Va")
        assert (theirs["abscissa_axis_units_lab"], theirs["ordinate_axis_units_lab"]) == ("Hz", UNITS[name])
        np.testing.assert_allclose(theirs["x"], f, rtol=F_DIGITS)
        np.testing.assert_allclose(theirs["data"].view(float), H[:, i].copy().view(float), rtol=H_DIGITS)


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("even", [0, 1])
@pytest.mark.parametrize("double", [True, False])
def test_functions_written_by_pyuff(binary, even, double, tmp_path):
    """Text and binary, even and stated abscissa, double and single (which pyuff writes as text only)."""
    if not double and (binary or not even):
        pytest.skip("pyuff writes single precision only as text with an even abscissa")
    f = np.arange(1, 300) * 0.5
    H, path = plant(f), tmp_path / "b.uff"
    for i, name in enumerate(("de", "Vs")):
        made = {"type": 58, "func_type": 4, "rsp_node": i + 1, "rsp_dir": 3, "ref_node": 9, "ref_dir": -1,
                "rsp_ent_name": name, "x": f, "data": H[:, i], "abscissa_spacing": even, "binary": binary,
                "ord_data_type": 6 if double else 5, "orddenom_spec_data_type": 0}  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pyuff.UFF(str(path)).write_sets(made, "add", force_double=double)
    found = read_frf(path)
    assert found.channels == ("de", "Vs")
    assert found.input_name == "9-X"  # no entity given: its degree of freedom
    assert found.units == {"de": "", "Vs": "", "9-X": ""}
    np.testing.assert_allclose(found.f, f, rtol=1e-5)
    np.testing.assert_allclose(found.H, H, rtol=1e-11 if double else 1e-5)


def test_fortran_exponents_padded_lines_and_other_sets(tmp_path):
    f = AXES["even"][:5]
    raw = uff.frf_bytes(f, plant(f), ["de", "Vs"], "Va", UNITS).decode()
    lines = [line.ljust(80) for line in raw.replace("e-", "D-").replace("e+", "D+").split("\n")]
    other = ["    -1", "   151", "a model", "", "    -1"]
    path = tmp_path / "c.uff"
    path.write_bytes("\r\n".join([*other, *lines]).encode())
    found = read_frf(path)
    np.testing.assert_allclose(found.H.view(float), plant(f).view(float), rtol=H_DIGITS)


def test_every_cut_is_refused(tmp_path):
    f = AXES["even"][:20]
    raw, path = uff.frf_bytes(f, plant(f), ["de", "Vs"], "Va", UNITS), tmp_path / "d.uff"
    for end in range(1, len(raw) - 2, 37):  # a cut between the sets leaves a whole file of one: not one of these
        path.write_bytes(raw[:end])
        try:
            found = read_frf(path)
        except RecordError:
            continue
        pytest.fail(f"{end} of {len(raw)} bytes were read as {found.channels}")


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda raw: raw.replace(b"        Va", b"        Vb", 1), "of the inputs ['Va', 'Vb']; expected one input"),
        (lambda raw: raw.replace(b"        Vs", b"        de"), "expected one input, each once"),
        (lambda raw: raw + raw.replace(b" 5.000000e-01", b" 6.000000e-01"), "each once"),
        (lambda raw: raw.replace(b"    4         0", b"    1         0"), "holds no frequency response function"),
        (lambda raw: raw.replace(b" 5.000000e-01 5.0", b" 5.000000e-01 0.0", 2), "frequencies must increase"),
        (lambda raw: raw.replace(b" 5.000000e-01 5.0", b" 5.000000e-01 1.0", 1), "different frequency axes"),
    ],
)
def test_functions_that_are_refused(edit, words, tmp_path):
    f = AXES["even"][:20]
    path = tmp_path / "e.uff"
    path.write_bytes(edit(uff.frf_bytes(f, plant(f), ["de", "Vs"], "Va", UNITS)))
    with pytest.raises(RecordError) as refused:
        read_frf(path)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"H": np.full((5, 2), np.nan + 0j)}, "NaN or inf"),
        ({"H": np.ones((4, 2), complex)}, r"H is \(4, 2\) for 5 frequencies"),
        ({"f": np.array([1.0, 2.0, 2.0, 3.0, 4.0])}, "must increase"),
        ({"channels": ["de", "a name too long"]}, "does not fit"),
        ({"input_name": "NONE"}, "does not fit"),
    ],
)
def test_what_is_not_written(change, words):
    good = {"f": np.arange(1.0, 6.0), "H": np.ones((5, 2), complex), "channels": ["de", "Vs"], "input_name": "Va"}
    with pytest.raises(ValueError, match=words):
        uff.frf_bytes(**(good | change), units=UNITS)


def test_a_count_that_the_file_cannot_hold_takes_no_memory(tmp_path):
    """Red before: the times of two milliards of values were made, 15 GB, to list the channels of a file of 1 kB."""
    path = tmp_path / "a.uff"
    path.write_bytes(uff.frf_bytes(np.arange(1, 20) * 0.5, np.ones((19, 1)), ["de"], "Va", UNITS))
    stated, function = b"         4        19         1", b"    4         0    0"
    assert path.read_bytes().count(stated) == path.read_bytes().count(function) == 1
    content = path.read_bytes().replace(stated, b"         42000000000         1")
    path.write_bytes(content.replace(function, b"    1         0    0"))
    with pytest.raises(RecordError, match="declares 2000000000 values in"):
        list_channels(path)
