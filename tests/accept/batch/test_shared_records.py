"""One recording in the folders of two units is told, whatever the files are called; a unit is no twin of itself."""

from accept.units.duplicate_records import same_records


def entry(serial: str, **inputs: str) -> dict:
    return {"serial": serial, "inputs": {name.replace("_", "."): sha256 for name, sha256 in inputs.items()}}


def test_the_same_bytes_in_two_units_are_told() -> None:
    (words,) = same_records([entry("A-01", low_mat="aa"), entry("A-02", high_mat="aa", unit_toml="bb")], [])
    assert words.startswith("A-01 and A-02")
    assert "low.mat as high.mat" in words


def test_a_unit_judged_before_is_remembered_and_its_own_earlier_result_is_none() -> None:
    known = [entry("A-01", low_mat="aa"), entry("A-02", low_mat="cc")]
    assert len(list(same_records([entry("A-03", low_mat="aa")], known))) == 1
    assert not list(same_records([entry("A-01", low_mat="aa")], known))


def test_what_was_said_before_is_not_said_again_nor_equal_unit_files() -> None:
    known = [entry("A-01", low_mat="aa"), entry("A-02", low_mat="aa")]
    assert not list(same_records([entry("A-03", low_mat="dd")], known))
    assert not list(same_records([entry("A-04", unit_toml="ee"), entry("A-05", unit_toml="ee")], []))
