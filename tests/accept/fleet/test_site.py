"""The page of the fleet in a real Chromium, from a file: 2,000 units, offline, and nothing of a unit runs."""

import datetime
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.fleet.golden import name_golden
from accept.fleet.measurements import measurements
from accept.fleet.site.page_data import curves, document, script
from accept.fleet.site.write_site import write_site
from accept.fleet.trend import summary, trends
from accept.fleet.yields import yields
from accept.pictures.labels import label_of
from accept.store import open_store
from accept.store.payloads import CertificateSigned
from checks.picture import Line, Panel
from tests.accept.fleet.judgements import add, judgement
from tests.accept.fleet.test_month import month
from tests.conftest import CHROMIUM
from tests.soak import SOAK

LONG_AGO = datetime.datetime(2020, 5, 4, tzinfo=datetime.UTC)
ARGUMENTS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
EVIL = "<img src=x onerror=\"document.title='owned'\"></script><script>document.title='owned'</script>"


def written(out: Path) -> Path:
    done = CliRunner().invoke(app, ["site", "--out", str(out)])
    assert done.exit_code == 0, done.output
    return out / "index.html"


def fill(units: int) -> None:
    rng = np.random.default_rng(3)
    values = zip(5.0 + 0.2 * rng.standard_normal(units), 360 + 20 * rng.standard_normal(units), strict=True)
    with open_store() as store:
        add(store, [judgement(f"U-{i:04d}", {"sensor_uF": c, "stroke_um": d}) for i, (c, d) in enumerate(values)])


@pytest.fixture(scope="module")
def browser() -> Iterator[object]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        opened = running.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def page(browser):
    made = browser.new_page()
    made.set_default_timeout(120_000)  # other tests run beside it
    made.asked, made.faults = [], []
    made.on("request", lambda request: made.asked.append(request.url))
    made.on("pageerror", lambda error: made.faults.append(str(error)))
    yield made
    assert made.faults == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in made.asked)
    made.close()


def until(page, expression: str, wanted: object) -> None:
    """Asked from here again and again: the page's policy lets no script be made of a text, playwright's neither."""
    for _ in range(1200):
        if page.evaluate(expression) == wanted:
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"{expression} is {page.evaluate(expression)}, expected {wanted}")


def drawn(page, units: int) -> None:
    until(page, "document.body.dataset.drawn", str(units))


@pytest.mark.browser
@pytest.mark.slow
def test_more_units_than_a_table_shows_at_once(page, tmp_path):
    """How long it takes is measured in `benchmarks/bench_site.py`."""
    units = 2000 if SOAK else 400
    fill(units)
    page.goto(written(tmp_path).as_uri())
    drawn(page, units)
    assert page.locator("#table tbody tr").count() == 100
    page.click("#more")
    assert page.locator("#table tbody tr").count() == 300


@pytest.mark.browser
@pytest.mark.slow
def test_no_button_of_a_plot_sends_anything(page, tmp_path):
    """Every button of every plot is clicked; the fixture holds that no request left the page."""
    opened = []
    fill(30)
    page.goto(written(tmp_path).as_uri())
    drawn(page, 30)
    page.context.on("page", lambda other: opened.append(other.url))
    buttons = page.locator(".modebar-btn")
    titles = [buttons.nth(i).get_attribute("data-title") for i in range(buttons.count())]
    assert any("Zoom" in title for title in titles)
    assert not [title for title in titles if "share" in title.lower() or "cloud" in title.lower()]
    for i in range(buttons.count()):
        buttons.nth(i).dispatch_event("click")
    assert opened == []


@pytest.mark.browser
@pytest.mark.slow
def test_filters_search_and_keys(page, tmp_path):
    fill(60)
    with open_store() as store:
        add(store, [judgement("LAST", {"sensor_uF": 1.7}, "bench-9")], who="Bob")
        add(store, [judgement("OLD", {"sensor_uF": None})], who="Eve", at=LONG_AGO)
    page.goto(written(tmp_path).as_uri())
    drawn(page, 62)
    assert "62 units" in page.text_content("#summary")
    page.keyboard.press("/")
    page.keyboard.type("last")
    drawn(page, 1)
    page.fill("#search", "")
    for name, value, units in (("bench", "bench-9", 1), ("operator", "Eve", 1), ("verdict", "incomplete", 1)):
        page.select_option(f"#{name}", value)
        drawn(page, units)
        page.click("#reset")
        drawn(page, 62)
    page.fill("#to", "2020-05-04")
    drawn(page, 1)
    assert page.text_content("#table tbody td") == "OLD"
    page.click("#reset")
    drawn(page, 62)
    page.fill("#from", "2999-01-01")
    drawn(page, 0)
    assert "Nothing to show" in page.text_content("#yield-plot")
    page.click("#reset")
    drawn(page, 62)
    for name, unit in (("stroke_um", "µm"), ("sensor_uF", "µF")):
        page.select_option("#quantity", name)
        until(page, "document.getElementById('trend-plot').layout.yaxis.title.text", f"{label_of(name)} [{unit}]")
    page.click("th button >> text=serial")
    page.locator("#table tbody tr").first.focus()
    page.keyboard.press("Enter")
    assert "sensor_uF" in page.text_content("#detail-body")
    assert page.url.endswith("#unit=LAST")
    page.keyboard.press("Escape")
    assert page.is_hidden("#detail")
    before = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.click("#theme")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") != before
    assert page.locator("nav a[href='#curves']").is_hidden()  # no curves were named, so there is nothing to go to
    for link in page.locator("nav a:visible").all():
        link.click()
        assert page.locator(link.get_attribute("href")).is_visible()


@pytest.mark.browser
@pytest.mark.slow
def test_the_page_says_what_the_trend_says(page, tmp_path):
    """The month of all causes: alarms in words, dates on the axis, yield by day and week, values in the digits of U."""
    with open_store() as store:
        add(store, month(8))
        frame = measurements(store)
    page.goto(written(tmp_path).as_uri())
    drawn(page, 200)
    page.select_option("#quantity", "sensor_uF")
    (alarm,) = summary(trends(frame, "sensor_uF", "all")[0])["alarms"]
    until(page, f"document.getElementById('alarms').textContent.includes({json.dumps(alarm['words'])})", True)
    assert page.evaluate("document.getElementById('trend-plot').layout.xaxis.type") == "date"
    assert page.evaluate("document.getElementById('trend-plot').data[0].x[0]").startswith("2026-10-01")
    page.select_option("#trend-by", "bench")
    until(page, "document.getElementById('trend-plot').data.slice(0, 2).map(t => t.name).join()", "B1,B2")
    for period, bars in (("month", 1), ("week", 4), ("day", 20), ("bench", 2), ("lot", 10)):
        page.select_option("#period", period)
        until(page, "document.getElementById('yield-plot').data[0].x.length", bars)
    made = yields(frame, "lot")
    assert page.evaluate("document.getElementById('yield-plot').data[0].y") == pytest.approx(100 * made["first_pass"])
    page.locator("#table tbody tr").first.click()
    rows = page.locator("#detail-body td").all_text_contents()
    assert any(re.fullmatch(r"4\.\d{3} µF", text) for text in rows)  # U is 0.020 uF


@pytest.mark.browser
@pytest.mark.slow
def test_a_month_is_read_by_an_assessor(page, tmp_path):
    """Golden units are in no count, what happened is neither cut nor squeezed at either width, every mark of a plot is
    explained, and the page of a month does not call it the last judgements."""
    with open_store() as store:
        add(store, month(8))
        add(store, [judgement("GOLD", {"sensor_uF": 4.9}, "B1", day=datetime.date(2026, 10, 20))])
        name_golden(store, "GOLD", "accepted", "Grace")
    done = CliRunner().invoke(app, ["site", "--out", str(tmp_path), "--since", "2026-10-06"])
    assert done.exit_code == 0, done.output
    page.goto((tmp_path / "index.html").as_uri())
    drawn(page, 151)
    words = page.text_content("#summary")
    assert words.startswith("150 units, 150 judgements, ")
    assert "; beside them 1 judgement of golden units; this page has 151 of 201 judgements; measured from" in words
    page.select_option("#quantity", "sensor_uF")
    until(page, "document.getElementById('marks').textContent.includes('diamonds: an alarm begins')", True)
    assert "95 % interval" in page.text_content("#yield")
    page.fill("#search", "gold")
    drawn(page, 1)
    assert page.text_content("#table tbody td.accepted") == "accepted, golden unit"
    wide = "[...document.querySelectorAll('#happened td:last-child')].map(td => td.clientWidth / innerWidth)"
    for width in (1400, 420):
        page.set_viewport_size({"width": width, "height": 900})
        assert min(page.evaluate(wide)) > 0.5
        cut = "(d => d.scrollWidth > d.clientWidth)(document.querySelector('#happenings .wide'))"
        assert not page.evaluate(cut)


def test_a_unit_leads_to_its_certificate(tmp_path):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "A 1.pdf").write_bytes(b"%PDF-")
    with open_store() as store:
        add(store, [judgement("A-1", {"sensor_uF": 5.0}), judgement("A-2", {"sensor_uF": 5.0})])
        signed = CertificateSigned(str(tmp_path / "c" / "A 1.pdf"), "0" * 64, "technician")
        store.write(signed, "A-1", who="Ann")
        content = document(store, {}, tmp_path / "page")
    assert [j["certificate"] for j in content["judgements"]] == ["./../c/A%201.pdf", None]


@pytest.mark.browser
@pytest.mark.slow
def test_paper_is_white_and_no_wider_than_a_sheet(page, tmp_path):
    """Printed from the dark page: dark ink, plots within A4's 186 mm, and the screen as it was afterwards."""
    fill(20)
    page.emulate_media(color_scheme="dark")
    page.goto(written(tmp_path).as_uri())
    drawn(page, 20)
    look = "(d => [d.layout.font.color, d._fullLayout.width])(document.getElementById('trend-plot'))"
    before = page.evaluate(look)
    page.evaluate("window.seen = []")
    page.evaluate(f"addEventListener('beforeprint', () => seen.push({look}))")
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    (printed,) = page.evaluate("seen")
    assert printed[0] == "#1b1f24"
    assert printed[1] <= 186 / 25.4 * 96
    until(page, look, before)


@pytest.mark.browser
def test_nothing_that_stands_in_a_unit_runs(page, tmp_path):
    evil = judgement(EVIL, {"sensor_uF": 1.7})
    evil.payload["result"]["notes"] = [EVIL]
    with open_store() as store:
        add(store, [evil])
    page.goto(written(tmp_path).as_uri())
    drawn(page, 1)
    page.locator("#table tbody tr").first.click()
    assert EVIL in page.text_content("#detail-body")
    assert page.title() == "accept: fleet"
    assert page.locator("#detail-body img").count() == 0


@pytest.mark.browser
@pytest.mark.slow
def test_curves_lie_over_each_other(page, tmp_path):
    fill(3)
    x = np.geomspace(10, 1000, 5000)
    pictures = [Panel("Vs", "f [Hz]", "|H|", (Line(x, k / x, role="data"),), x_log=True) for k in (1.0, 2.0)]
    lines = {f"U-000{i}": {"frf": picture} for i, picture in enumerate(pictures)}
    with open_store() as store:
        content = document(store, curves(lines))
    write_site(tmp_path, content)
    page.goto((tmp_path / "index.html").as_uri())
    drawn(page, 3)
    shown = page.evaluate("document.getElementById('curves-plot').data.map(t => [t.name, t.x.length, t.y[0]])")
    assert [(name, y) for name, _, y in shown] == [("U-0000", 0.1), ("U-0001", 0.2)]
    assert all(400 <= n <= 500 for _, n, _ in shown)  # thinned for the page
    page.fill("#search", "u-0001")
    until(page, "document.getElementById('curves-plot').data.length", 1)


def test_the_data_only_assign(tmp_path):
    """No byte of a unit can end the script: `<` stands escaped, and what is between is JSON."""
    text = script({"a": [EVIL, "\u2028"]})
    assert "<" not in text
    body = re.fullmatch(r"window\.FLEET=(.*);\n", text, re.DOTALL)
    assert json.loads(body[1]) == {"a": [EVIL, "\u2028"]}


def test_an_empty_store_gives_no_page(tmp_path):
    done = CliRunner().invoke(app, ["site", "--out", str(tmp_path)])
    assert done.exit_code == 6
    assert not os.listdir(tmp_path)
