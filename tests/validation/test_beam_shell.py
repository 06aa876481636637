"""The shell of beams that stands for the public matrices where they are absent: its figures, and its file."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

from checks.model.structure.superelement_check import mass
from hw.superelement import read_superelement
from tests.checks.model.statics import amplification, clamped_modes_Hz, end_compliance
from validation import shell
from validation.shell import NODES


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The file that is drawn where the public matrices are absent."""
    monkeypatch.setattr(shell, "PUBLIC", tmp_path / "APA300ML.mat")
    monkeypatch.setattr(shell, "BEAMS", tmp_path / "beams.mat")
    shell._drawn.cache_clear()
    yield shell.matrices()
    shell._drawn.cache_clear()


def test_it_has_the_published_figures(drawn: Path) -> None:
    """Those of `tests/checks/model/test_model_superelement.py`, as near as beams come: 3 %, amplification 5 %. As many
    elastic modes, so that what is drawn for each is alike."""
    found = read_superelement(drawn)
    assert mass(found) == pytest.approx(0.1153, rel=0.03)
    assert clamped_modes_Hz(found, NODES["bottom"])[:3] == pytest.approx([294.6, 525.2, 709.4], rel=0.03)
    stiffness = 1e-6 / np.diag(end_compliance(found, NODES["bottom"], NODES["top"]))[:3]
    assert stiffness == pytest.approx([0.360, 0.266, 1.753], rel=0.03)
    assert amplification(found, (NODES["sensor_left"], NODES["sensor_right"])) == pytest.approx(-4.71, rel=0.05)
    assert amplification(found, (NODES["actuator_left"], NODES["actuator_right"])) == pytest.approx(-4.895, rel=0.05)
    modes = np.sqrt(np.abs(linalg.eigvalsh(found.K, found.M))) / (2 * np.pi)
    assert np.sum(modes > shell.RIGID_BELOW_HZ) == 156


def test_its_file_is_the_same_each_time(drawn: Path) -> None:
    """Its hash stands among those of what a unit was run with."""
    first = drawn.read_bytes()
    drawn.unlink()
    shell._drawn.cache_clear()
    assert shell.matrices().read_bytes() == first
    assert not list(drawn.parent.glob("beams-*"))
