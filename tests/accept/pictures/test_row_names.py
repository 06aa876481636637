"""Long names of rows get room of their own; short ones leave the axes where those of other panels are."""

import numpy as np

from accept.pictures.pdf.fonts import register
from accept.pictures.pdf.panels import _room_for_names
from checks.picture import Line, Panel


def test_long_names_of_rows_have_room_and_short_ones_move_nothing() -> None:
    register()
    both = np.array([0.0, 1.0])

    def room(*names: str) -> float:
        return _room_for_names(Panel("t", "x", "", (Line(both, both),), y_names=names), 510.0)

    assert room("Vs before", "de after") == 0.0
    assert 20.0 < room("joints: torsional stiffness kRz") < 170.0
    assert room("a" * 400) == 170.0
