"""The pictures of the page for QA: a fleet of drawn units, as `accept history`, `yield`, `trend` and `site` show it.
Half a year of 240 units on one bench, the stroke drifts by 1.5 um a month; some have a fault, one was repaired.

Run by hand: `python tests/accept/fleet/picture_fleet.py docs/img/fleet`. The page is drawn where a Chromium is there.
"""

import datetime
import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))
from accept.fleet import history, trend, yields
from accept.fleet.measurements import measurements
from accept.fleet.site.page_data import document
from accept.fleet.site.write_site import write_site
from accept.pictures.draw import picture
from accept.pictures.reduce import reduce_panel
from accept.store import Store, open_store
from checks.picture import Panel
from tests.accept.fleet.judgements import add, judgement
from tests.conftest import CHROMIUM

DOTS, WIDE_MM, HIGH_MM = 110.0, 88.0, 62.0
REPAIRED = "A-031"


def fill(store: Store) -> None:
    """Seeded: the pictures are the same every time."""
    rng = np.random.default_rng(18)
    for n in range(240):
        month, day = 5 + n // 40, 1 + (n % 40) // 2
        values: dict[str, float | None] = {
            "stroke_um": round(rng.normal(352.0 - 1.5 * (month - 5), 4.0), 1),
            "sensor_uF": round(rng.normal(5.1, 0.06), 3),
        }
        fault = rng.random()
        if fault < 0.03:
            values["sensor_uF"] = 1.7
        elif fault < 0.07 or f"A-{n:03d}" == REPAIRED:
            values["stroke_um"] = round(rng.normal(285.0, 8.0), 1)
        elif fault < 0.09:
            values["stroke_um"] = None
        at = datetime.datetime(2026, month, day, 9, tzinfo=datetime.UTC)
        add(store, [judgement(f"A-{n:03d}", values, "bench-1")], who="Ann" if n % 40 < 20 else "Bob", at=at)
    again = judgement(REPAIRED, {"stroke_um": 349.8, "sensor_uF": 5.1}, "bench-1")
    add(store, [again], at=datetime.datetime(2026, 6, 2, 9, tzinfo=datetime.UTC))


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        os.environ["ACCEPT_HOME"] = place
        with open_store() as store:
            fill(store)
            frame = measurements(store)
            content = document(store, {})
        (stroke,) = trend.trends(frame, "stroke_um", "all")
        _written(out / "trend.png", trend.chart_panels(stroke), 2 * WIDE_MM)
        unit = frame[frame["serial"] == REPAIRED]
        _written(out / "history.png", history.panels(history.changes(unit)), 2 * WIDE_MM)
        made = yields.yields(frame, "month")
        _written(out / "yield.png", yields.panels(made, yields.pareto(frame), "month"), 2 * WIDE_MM)
        write_site(Path(place) / "page", content)
        _site(Path(place) / "page" / "index.html", out / "site.png")


def _written(path: Path, panels: list[Panel], wide_mm: float) -> None:
    content = picture([reduce_panel(p) for p in panels], "png", (wide_mm, HIGH_MM), columns=len(panels), dots=DOTS)
    path.write_bytes(content)
    print(path, len(content))


def _site(page: Path, path: Path) -> None:
    if find_spec("playwright") is None or CHROMIUM is None:
        print(f"{path}: stays as it is, no Chromium is here")
        return
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        shown = browser.new_page(viewport={"width": 1280, "height": 1000})
        shown.set_default_timeout(120_000)
        shown.goto(page.as_uri())
        shown.wait_for_selector("body[data-drawn]")
        shown.screenshot(path=path)
        browser.close()
    print(path, path.stat().st_size)


if __name__ == "__main__":
    main()
