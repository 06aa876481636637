"""gap.html in a real Chromium: it opens from a file without a network, draws every plot, and runs nothing of a unit."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from accept.gap.report import render_html
from checks.gap import Result
from tests.accept.fleet.test_site import ARGUMENTS, EVIL
from tests.conftest import CHROMIUM

pytest.importorskip("plotly")


@pytest.fixture
def page() -> Iterator[object]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        opened = browser.new_page()
        opened.set_default_timeout(120_000)  # other tests run beside it
        yield opened
        browser.close()


@pytest.mark.browser
def test_every_plot_is_drawn_and_no_word_of_a_unit_runs(result: Result, page, tmp_path: Path) -> None:
    evil = replace(result, notes=(EVIL,), model=EVIL)
    file = tmp_path / "gap.html"
    file.write_bytes(render_html(EVIL, evil))
    asked: list[str] = []
    faults: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(file.as_uri())
    page.wait_for_selector("#plot-3 .main-svg")  # the map, then a plot for each of three channels
    assert page.locator(".plotly-graph-div .main-svg").count() >= 4
    traces = page.evaluate("document.getElementById('plot-1').data.map(t => t.name || '')")
    assert {"measured", "model before", "model after", "95 % of the measurement", "95 % of the model after"} <= set(
        traces
    )
    assert page.evaluate("document.getElementById('plot-1').layout.xaxis3 !== undefined")  # three panels on one axis
    assert EVIL in page.text_content("h1")
    assert page.title().startswith(EVIL)
    assert page.locator("body img").count() == 0
    page.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"document.title=1\">')")
    page.wait_for_timeout(200)
    assert page.title().startswith(EVIL)  # even what got into the page could not run
    assert "Why this cause, and why not another" in page.text_content("body")
    assert faults == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in asked)
