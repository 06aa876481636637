"""Pictures on a certificate: drawn as vectors, every item and word of a panel, equal panels to equal bytes."""

import hashlib
import io
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pypdf import PdfReader
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from accept.pictures.pdf.fonts import BOLD, MONO, REGULAR, register
from accept.pictures.pdf.panels import BOTTOM, LEFT, RIGHT, TOP, draw_panel
from accept.pictures.scale import Scale, scales
from checks.picture import Heights, Image, Line, Panel, Text
from tests.accept.pictures.test_pictures import EVERYTHING, MAPS
from tests.soak import SOAK

X, Y, WIDTH, HEIGHT = 40.0, 500.0, 180.0, 160.0


def drawn(*panels: Panel) -> bytes:
    """A page with the panels side by side."""
    register()
    buffer = io.BytesIO()
    canvas = Canvas(buffer, invariant=1, pageCompression=0)
    for nth, panel in enumerate(panels):
        draw_panel(canvas, panel, X + nth * WIDTH, Y, WIDTH, HEIGHT)
    canvas.save()
    return buffer.getvalue()


def test_every_word_of_a_panel_is_on_the_page() -> None:
    text = PdfReader(io.BytesIO(drawn(EVERYTHING, MAPS))).pages[0].extract_text()
    labels = ["All kinds of items", "f [Hz]", "|H| [µm]", "curve", "dashed", "point", "band", "zone"]
    for words in [*labels, "mains", "limit", "here", "likelihood", "height [µm]", "Maps"]:
        assert words in text, words


@pytest.mark.parametrize("nth", range(len(EVERYTHING.items)))
def test_every_item_leaves_its_mark(nth: int) -> None:
    """A page without one item is another page."""
    fewer = replace(EVERYTHING, items=EVERYTHING.items[:nth] + EVERYTHING.items[nth + 1 :])
    assert drawn(fewer) != drawn(EVERYTHING)


@pytest.mark.slow
def test_the_same_bytes_in_another_process() -> None:
    program = (
        "import hashlib; from tests.accept.pictures.pdf.test_panel_drawing import *\n"
        "print(hashlib.sha256(drawn(EVERYTHING, MAPS)).hexdigest())"
    )
    environment = os.environ | {"PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo"}
    root = Path(__file__).parents[4]
    done = subprocess.run([sys.executable, "-c", program], cwd=root, env=environment, capture_output=True, check=True)
    assert done.stdout.decode().strip() == hashlib.sha256(drawn(EVERYTHING, MAPS)).hexdigest()


def test_a_curve_stands_where_its_values_are() -> None:
    """Both ends of a straight line, and an interruption where there is no number."""
    line = Line(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, np.nan, 3.0]), role="bad")
    panel = Panel("", "", "", (line,))
    wide, tall = WIDTH - LEFT - RIGHT, HEIGHT - BOTTOM - TOP
    x, y = scales(panel, wide, tall)
    assert float(x.at(0.0)) == pytest.approx(0.05 / 1.1)  # a margin of 5 % at both ends
    points = [(X + LEFT + wide * float(x.at(v)), Y + BOTTOM + tall * float(y.at(v))) for v in (0.0, 1.0, 3.0)]
    path = "{:.2f} {:.2f} m {:.2f} {:.2f} l".format(*points[0], *points[1])
    page = drawn(panel).decode("latin-1")
    assert path in page
    assert "{:.2f} {:.2f} m".format(*points[2]) in page
    assert "{:.2f} {:.2f} l".format(*points[2]) not in page


def test_equal_scales_are_equal() -> None:
    line = Line(np.array([0.0, 10.0]), np.array([0.0, 1.0]))
    x, y = scales(Panel("", "", "", (line,), equal=True), 100.0, 50.0)
    assert (x.hi - x.lo) / 100.0 == pytest.approx((y.hi - y.lo) / 50.0)
    assert x.lo < 0.0 < 10.0 < x.hi


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e9), st.booleans(), st.booleans(), st.integers(2, 9))
@example(100000.0, 1.0, False, False, 2)  # six digits would call both ends 10⁵
def test_every_axis_can_be_read(lo: float, span: float, log: bool, degrees: bool, most: int) -> None:
    """Ticks lie within the limits, each says another number, and there are not more than asked for, or a few more where
    a logarithm needs them."""
    if log:
        lo = 10.0 ** (lo / 1e5)
        scale = Scale(lo, lo * 10.0 ** min(span, 12.0) if span > 0.05 else lo * 1.2, True)
    else:
        hi = lo + span
        if not hi - lo > 1e-9 * max(abs(lo), abs(hi)):
            return
        scale = Scale(lo, hi, False, degrees)
    ticks = scale.ticks(most)
    assert len(ticks) <= most + 1 + 3 * log
    assert all(-1e-6 <= float(scale.at(value)) <= 1 + 1e-6 for value, _ in ticks)
    if scale.hi - scale.lo > 1e-6 * abs(scale.hi):
        assert len({words for _, words in ticks}) == len(ticks)


@given(
    st.lists(st.sampled_from([0.0, -1.0, 1e-300, 1e300, math.nan, math.inf, -math.inf, 3.0]), min_size=1, max_size=5)
)
@settings(max_examples=100 if SOAK else 30)
def test_no_value_stops_the_drawing(values: list[float]) -> None:
    """Not one, none finite, none positive on a logarithmic axis, or of every size at once."""
    array = np.array(values)
    items = (Line(array, array, "a"), Line(array, array, "b", "points"), Text(values[0], values[-1], "t"))
    for log in (False, True):
        pages = drawn(Panel("title", "x", "y", items, x_log=log, y_log=log))
        assert not re.search(rb"(nan|inf) ", pages)
    drawn(
        Panel(
            "m",
            "x",
            "y",
            (Heights(array, array, array, "z"), Image(np.arange(2.0), array[:1], array[:1, None] * np.ones(2))),
        )
    )


@pytest.mark.parametrize("font", [REGULAR, BOLD, MONO])
@pytest.mark.parametrize("text", ["", "Bending in x", "µm ≤ 10 Ω", "\u4e2d no glyph", "long " * 40, b"bytes \xc2\xb5"])
def test_a_kept_width_is_that_of_reportlab(font: str, text: str | bytes) -> None:
    register()
    face = pdfmetrics.getFont(font)
    wanted = TTFont.stringWidth(face, text, 7.5)
    assert [face.stringWidth(text, 7.5), face.stringWidth(text, 7.5)] == [wanted, wanted]
    assert face.stringWidth(text, 15.0) == TTFont.stringWidth(face, text, 15.0)
