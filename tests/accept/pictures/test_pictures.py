"""Pictures: same panels, same bytes, wherever and whenever; cutting down loses no peak and can be repeated."""

import hashlib
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from accept.pictures.colours import ROLES, SERIES
from accept.pictures.draw import FORMATS, PictureError, draw, picture
from accept.pictures.items import draw_panel, set_degree_ticks, settings
from accept.pictures.jsonform import panels_from_json, panels_to_json
from accept.pictures.reduce import POINTS, reduce_panel
from accept.pictures.words import pretty
from checks.picture import Band, Heights, Image, Line, Mark, Panel, Span, Text
from tests.accept.certificate import certificate_help

EVERYTHING = Panel(
    "All kinds of items",
    "f [Hz]",
    "|H| [um]",
    (
        Line(np.array([1.0, 10.0, 100.0]), np.array([1.0, np.nan, 3.0]), "curve"),
        Line(np.array([1.0, 100.0]), np.array([2.0, 2.5]), "dashed", "dashed", "model"),
        Line(np.array([5.0]), np.array([1.5]), "point", "points", "bad"),
        Band(np.array([1.0, 100.0]), np.array([0.9, 2.0]), np.array([1.4, 3.1]), "band"),
        Span(-np.inf, 2.0, "y", "zone", "good"),
        Span(3.0, np.inf),
        Mark(50.0, "x", "mains"),
        Mark(2.9, "y", "limit"),
        Text(10.0, 2.0, "here"),
    ),
    x_log=True,
    y_range=(0.5, 3.5),
)
MAPS = Panel(
    "Maps",
    "x",
    "y",
    (
        Image(np.arange(300.0), np.arange(250.0), np.outer(np.arange(250.0), np.arange(300.0)), "likelihood"),
        Heights(np.array([0.0, 100.0]), np.array([0.0, 100.0]), np.array([1.0, np.nan]), "height [um]"),
    ),
)


@pytest.mark.parametrize("kind", FORMATS)
def test_every_item_is_drawn_and_twice_the_same(kind: str) -> None:
    first = picture([EVERYTHING, MAPS], kind)
    assert len(first) > 5000
    assert picture([EVERYTHING, MAPS], kind) == first


@pytest.mark.slow
def test_the_same_bytes_in_another_process_and_place(tmp_path: Path) -> None:
    """Another hash seed, time zone, folder and a matplotlibrc of one's own must not matter."""
    (tmp_path / "matplotlibrc").write_text("lines.linewidth: 9\nfont.size: 20\nsvg.hashsalt: mine\n")
    program = (
        "import sys, hashlib; sys.path.insert(0, sys.argv[1])\n"
        "from tests.accept.pictures.test_pictures import EVERYTHING, MAPS\n"
        "from accept.pictures.draw import FORMATS, picture\n"
        "print(*(hashlib.sha256(picture([EVERYTHING, MAPS], f)).hexdigest() for f in FORMATS))"
    )
    environment = os.environ | {"PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo", "SOURCE_DATE_EPOCH": "1"}
    command = [sys.executable, "-c", program, str(Path(__file__).parents[3])]
    there = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    here = [hashlib.sha256(picture([EVERYTHING, MAPS], kind)).hexdigest() for kind in FORMATS]
    assert there.stdout.split() == here


def test_a_different_value_gives_a_different_picture() -> None:
    moved = Panel("", "", "", (Line(np.array([0.0, 1.0]), np.array([0.0, 1.1])),))
    still = Panel("", "", "", (Line(np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 1.1])),))
    assert picture([moved], "svg") != picture([still], "svg")


def test_nothing_to_draw_and_unknown_formats_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="nothing to draw"):
        picture([], "png")
    with pytest.raises(PictureError, match=r"a\.gif: the name of a picture ends in \.pdf"):
        draw([MAPS], tmp_path / "a.gif")
    draw([EVERYTHING], tmp_path / "a.svg")
    assert (tmp_path / "a.svg").read_bytes().startswith(b"<?xml")
    stream = io.BytesIO()
    draw([EVERYTHING], stream, "pdf", (120.0, 60.0))
    assert stream.getvalue().startswith(b"%PDF")


def test_reducing_keeps_every_peak_and_is_done_once() -> None:
    rng = np.random.default_rng(5)
    y = rng.standard_normal(100_000)
    y[[77, 54_321]] = 50.0, -60.0
    y[1000:1010] = np.nan
    panel = Panel("", "", "", (Line(np.arange(1e5), y), Band(np.arange(1e5), y - 1, y + 1)))
    small = reduce_panel(panel)
    line, band = small.items
    assert isinstance(line, Line)
    assert isinstance(band, Band)
    assert len(line.x) <= POINTS + 1  # the last sample may come on top
    assert np.nanmax(line.y) == 50.0
    assert np.nanmin(line.y) == -60.0
    assert np.nanmax(band.hi) == 51.0
    assert np.nanmin(band.lo) == -61.0
    assert (line.x[0], line.x[-1]) == (0.0, 99_999.0)
    again = reduce_panel(small)
    assert panels_to_json({"a": again}) == panels_to_json({"a": small})


@pytest.mark.parametrize("power", [-320, -24, -22, -15, -6, 0, 5, 9, 16, 23, 300])
def test_numbers_are_those_that_their_seven_digits_are_read_as(power: int) -> None:
    """To the bit, since pages are compared to the byte: also at the middle of two, and about powers of ten."""
    rng = np.random.default_rng(8)
    whole = rng.integers(10**6, 10**7, 500).astype(float)
    values = np.concatenate([whole + 0.5, whole, whole + rng.uniform(-0.5, 0.5, 500), [1e6, 9999999.4999, 9999999.5]])
    values = np.concatenate([values, np.nextafter(values, 0.0), [0.0, np.nan, np.inf]]) * rng.choice([-1.0, 1.0])
    with np.errstate(all="ignore"):  # beyond the largest number
        values = values * 1e-6 * 10.0**power
    line = reduce_panel(Panel("", "", "", tuple(Line(x, x) for x in values.reshape(-1, 1)))).items
    read = [float(f"{v:.7g}") for v in values.tolist()]
    assert np.array_equal([item.y[0] for item in line if isinstance(item, Line)], read, equal_nan=True)


def test_panels_survive_json() -> None:
    panels = {"b": EVERYTHING, "a": MAPS, **certificate_help.panels()}
    small = {name: reduce_panel(panel) for name, panel in panels.items()}
    text = json.dumps(panels_to_json(small), allow_nan=False)
    back = panels_from_json(json.loads(text))
    assert list(back) == list(panels)
    assert json.dumps(panels_to_json({name: reduce_panel(panel) for name, panel in back.items()})) == text
    assert picture(list(back.values()), "svg") == picture(list(small.values()), "svg")


def test_a_phase_is_read_against_quarters_of_a_turn() -> None:
    axes = Figure().add_axes((0.1, 0.1, 0.8, 0.8))
    axes.set_ylim(-200.0, 200.0)
    set_degree_ticks(axes.yaxis)
    assert [t for t in axes.get_yticks() if abs(t) <= 200.0] == [-180.0, -90.0, 0.0, 90.0, 180.0]
    axes.set_ylim(-20.0, 5.0)  # a small phase keeps its own
    set_degree_ticks(axes.yaxis)
    assert len([t for t in axes.get_yticks() if -20.0 <= t <= 5.0]) > 1


def test_units_are_written_as_people_write_them() -> None:
    assert pretty("height [um], 5 uF, 231 urad, N/um") == "height [µm], 5 µF, 231 µrad, N/µm"
    assert pretty("flatness_um maximum album delay [us] use us") == "flatness_um maximum album delay [µs] use us"


def test_neighbouring_colours_differ_in_grey() -> None:
    """Luma (Rec. 601) of curves drawn one after the other: 0.08 is a step that a laser printer keeps apart."""
    luma = [np.dot(to_rgb(c), (0.299, 0.587, 0.114)) for c in (*SERIES, SERIES[0])]
    assert np.abs(np.diff(luma)).min() > 0.08
    good, bad = (np.dot(to_rgb(ROLES[r]), (0.299, 0.587, 0.114)) for r in ("data", "model"))
    assert abs(good - bad) > 0.08


def test_a_legend_covers_no_curve() -> None:
    """Curves that fill their axes: the best of matplotlib's places covered them."""
    f = np.geomspace(5.0, 700.0, 900)
    waves = [1 + 0.5 * np.sin(40 * np.log(f) + k) for k in range(3)]
    panel = Panel("p", "f [Hz]", "|H|", tuple(Line(f, y, f"curve {k}") for k, y in enumerate(waves)), x_log=True)
    with mpl.rc_context(settings()):
        figure = Figure(figsize=(3.5, 2.4))
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.15, 0.15, 0.8, 0.75))
        draw_panel(axes, panel)
        box = axes.get_legend().get_window_extent()
        for line in axes.lines:
            assert not line.get_transform().transform_path(line.get_path()).intersects_bbox(box, filled=False)
