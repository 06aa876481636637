"""The heavy lane: no proof is lost by being named wrongly, and what is changed brings its proofs back."""

import pytest

from tests import soak
from tests.soak import HEAVY, ROOT, is_heavy, runs, unknown

FILE = "tests/accept/store/test_store_kill.py"
KILLED = f"{FILE}::test_killed_at_every_point[new store]"


def test_files_and_folders_are_there() -> None:
    for file, heavy in HEAVY.items():
        assert (ROOT / file).is_file()
        assert [place for place in heavy.proves if not (ROOT / place).exists()] == []


def test_parameters_in_brackets_leave_the_others() -> None:
    assert is_heavy(KILLED)
    assert not is_heavy(f"{FILE}::test_killed_at_every_point[existing store]")
    assert is_heavy(f"{FILE}::test_killed_at_random_moments")


def test_an_entry_without_a_test_is_told() -> None:
    assert f"{FILE}::test_killed_at_random_moments" in unknown([KILLED])
    assert KILLED not in unknown([KILLED])


@pytest.mark.parametrize(
    ("changed", "wanted"), [("accept/store/chain.py", True), (FILE, True), ("accept/stores.py", False)]
)
def test_what_is_changed_brings_its_proofs_back(changed: str, wanted: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "SOAK", False)
    monkeypatch.setattr(soak, "_changed", lambda: (changed,))
    assert runs(KILLED) is wanted
