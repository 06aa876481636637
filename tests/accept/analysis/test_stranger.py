"""A stranger's CSV, other names, units, semicolons and decimal commas, from file to misalignment by the lines of the
page alone."""

import re
from pathlib import Path

import numpy as np
import pytest

import accept
from accept.analysis.record_responses import read_any
from accept.models.model_file import open_model
from accept.units.loaded_unit import loaded
from tests.checks.gap.shared.gap_units import make_strut
from tests.checks.misalignment.misaligned import table_of

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "exchange.md"
COLUMNS = {"Ausgang [V]": ("Va", 1.0), "Piezo [mV]": ("Vs", 1e3), "Geber [nm]": ("de", 1e9), "Laser [um]": ("da", 1e6)}
MOST_LINES = 10


def german_csv(source: Path, place: Path) -> None:
    record = read_any(source, "Va", {}, None)
    rows = zip(record.t, *(scale * record[channel] for channel, scale in COLUMNS.values()), strict=True)
    lines = (";".join(f"{v:.9g}" for v in row).replace(".", ",") for row in rows)
    place.write_text("\n".join([";".join(["Zeit [s]", *COLUMNS]), *lines]) + "\n", encoding="latin-1")


@pytest.mark.slow
def test_from_a_strangers_file_to_the_misalignment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = (b for b in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.M | re.S) if "Ausgang" in b)
    assert len(block.strip().splitlines()) <= MOST_LINES
    unit = make_strut(tmp_path / "X", "X", ("misalignment", {"dx_um": 20.0, "dy_um": -120.0}), repeats=False)
    for source, name in (("frf_noise.mat", "tief.csv"), ("frf_noise_hf.mat", "hoch.csv")):
        german_csv(unit / source, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    table = table_of(open_model("strut-as-built"), 7, 9)  # a small one: it only gives the starts
    monkeypatch.setattr("accept.analysis.misalignment.table_for", lambda *_, **__: table)
    names: dict = {}
    exec(compile(block, str(PAGE), "exec"), names)  # the project's own page
    off = names["off"]
    assert abs(off.dx.value - 20.0) < 1.5 * off.dx.U
    assert abs(off.dy.value + 120.0) < 1.5 * off.dy.U
    assert (tmp_path / "response.png").read_bytes().startswith(b"\x89PNG")
    assert accept.fit_model(names["response"], "strut").after  # the same response goes into a fit


def test_the_same_files_in_a_unit_folder(tmp_path: Path) -> None:
    """As the page says: `[frf]` names the files, `[channels]` the columns."""
    page = PAGE.read_text()
    assert all(words in page for words in ('low = "tief.csv"', 'high = "hoch.csv"', 'Va = "Ausgang"'))
    unit = make_strut(tmp_path / "X", "X", ("misalignment", {"dx_um": 20.0, "dy_um": -120.0}), repeats=False)
    truth = {}
    document = (unit / "unit.toml").read_text()
    for key, source, name in (("low", "frf_noise.mat", "tief.csv"), ("high", "frf_noise_hf.mat", "hoch.csv")):
        truth[key] = read_any(unit / source, "Va", {}, None)
        german_csv(unit / source, unit / name)
        document = document.replace(source, name)
    names = {channel: head.partition(" ")[0] for head, (channel, _) in COLUMNS.items()}
    document += "\n[channels]\n" + "".join(f'{here} = "{there}"\n' for here, there in names.items())
    (unit / "unit.toml").write_text(document)
    values = loaded(unit).values("frf")
    for key, record in truth.items():
        for channel, x in record.channels.items():  # nine digits are written
            np.testing.assert_allclose(values[key][channel], x, rtol=1e-8, atol=1e-8 * np.abs(x).max())
        assert "Geber" not in values[key].channels
        assert "de is in nm, converted to m" in "".join(values[key].remarks)
