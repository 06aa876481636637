"""Maps in the terminal: rows by their names in the order of the panel, a logarithmic axis with its middle."""

import numpy as np

from accept.tui.widgets.heat_map import map_text
from checks.picture import Image, Panel


def test_rows_have_their_names_from_above_and_the_middle_of_a_logarithmic_axis_is_its_own() -> None:
    z = np.zeros((2, 41))
    z[0, 20:] = 4.0  # the first row, above 100 Hz
    image = Image(np.geomspace(10.0, 1000.0, 41), np.arange(2.0), z, "log10 of G")
    panel = Panel(
        "G", "frequency [Hz]", "", (image,), x_log=True, y_range=(1.5, -0.5), y_names=("de before", "de after")
    )
    lines = map_text(image, panel, width=41, height=4).plain.splitlines()
    assert lines[0].lstrip().startswith("de before")
    assert lines[2].lstrip().startswith("de after")
    assert lines[0].count("█") == 21
    assert "█" not in lines[2] + lines[3]
    assert lines[4].split() == ["10", "100", "1e+03"]
    assert "up:" not in lines[5]
