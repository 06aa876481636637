"""The workflow in a real browser: focus at once, a unit in training from its serial to the verified certificate, by
keys alone. In the heavy lane all measurements of an APA, else the basic ones."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.accept.tui.terminal_programs.terminal import FILES
from tests.accept.tui.test_tui_web import free_port
from tests.conftest import CHROMIUM
from tests.soak import SOAK

pytest.importorskip("textual_serve")
pytestmark = [pytest.mark.browser, pytest.mark.slow]
TIMEOUT_S = 120.0  # for one answer on a crowded machine
SPEC = "apa" if SOAK else "apa-basic"


class Browser:
    """A page with the program in it; what the program writes is seen on its line."""

    def __init__(self, page) -> None:
        self.page, self.text, self.seen, self.events = page, "", 0, 0
        page.on("websocket", lambda line: line.on("framereceived", self._received))

    def _received(self, payload: str | bytes) -> None:
        self.text += payload if isinstance(payload, str) else payload.decode("utf-8", "replace")

    def wait_for(self, pattern: str) -> None:
        """Until this was written since the last key that was pressed."""
        deadline = time.monotonic() + TIMEOUT_S
        while not re.search(pattern, self.text[self.seen :]):
            assert time.monotonic() < deadline, f"{pattern!r} did not come; last: {self.text[-1500:]!r}"
            self.page.wait_for_timeout(50)

    def saved(self) -> None:
        """Until a higher event is acknowledged than any before: a line that is drawn again says the old one."""
        deadline = time.monotonic() + TIMEOUT_S
        while (last := self._last()) <= self.events:
            assert time.monotonic() < deadline, f"nothing was saved; last: {self.text[-1500:]!r}"
            self.page.wait_for_timeout(50)
        self.events = last

    def reads(self) -> None:
        """A reading, once more where the instrument did not answer in time: on a crowded machine instrument and program
        wait for one core."""
        self.wait_for("now ")  # what follows is of another style: signs that set it stand between
        for _ in range(5):
            self.press("F3")
            deadline = time.monotonic() + TIMEOUT_S / 6
            while self._last() <= self.events and time.monotonic() < deadline:
                self.page.wait_for_timeout(50)
            if self._last() > self.events:
                break
        self.saved()

    def _last(self) -> int:
        return max(map(int, re.findall(r"as entry (\d+)", self.text)), default=0)

    def press(self, *keys: str) -> None:
        for key in keys:
            self.seen = len(self.text)
            self.page.keyboard.press(key)

    def line(self, text: str) -> None:
        self.page.keyboard.type(text)
        self.press("Enter")


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    port = free_port()
    run = [sys.executable, "-m", "accept", "run", "--web", "--port", str(port), "--training", "--spec", SPEC]
    env = os.environ | {"ACCEPT_HOME": str(tmp_path / "home")}
    server = subprocess.Popen([*run, "--seed", "3", "--operator", "Ann"], env=env, stderr=subprocess.PIPE, text=True)
    try:
        said = server.stderr.readline()
        yield re.search(r"http://\S+", said)[0]
    finally:
        server.terminate()
        server.communicate(timeout=TIMEOUT_S)


def test_a_unit_in_training_by_keys_in_a_browser(address: str, tmp_path: Path) -> None:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": 1000, "height": 640})
        at = Browser(page)
        page.goto(address)
        at.wait_for("is a new unit")
        at.press("Enter", "Enter")  # without a click before: the page has the focus
        at.wait_for("Enter: open the step")
        measure(at)
        sign(at)
        chromium.close()
    certificates = list((tmp_path / "home").rglob("TRAIN-*.pdf"))
    assert len(certificates) == 1


DROP = """(bytes) => {
  const dropped = new DataTransfer();
  dropped.items.add(new File([new Uint8Array(bytes)], "a crack.png"));
  const event = new DragEvent("drop", { dataTransfer: dropped, bubbles: true, cancelable: true });
  document.querySelector("#terminal").dispatchEvent(event);
}"""


def test_keys_that_a_glove_hits_a_dropped_photo_and_plots_at_full_resolution(address: str, tmp_path: Path) -> None:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(1000 * TIMEOUT_S)
        at = Browser(page)

        def touch(*keys: str) -> None:
            for key in keys:
                at.seen = len(at.text)
                page.locator(f"#touch button[data-key={key}]").click()

        page.goto(address)
        at.wait_for("is a new unit")
        for width in (1280, 1000, 640):
            page.set_viewport_size({"width": width, "height": 800})
            assert_a_glove_hits_each_key(page)
        page.set_viewport_size({"width": 1280, "height": 800})
        touch("Enter", "Enter")
        at.wait_for("Enter: open the step")
        touch("F5")
        at.wait_for("Note on Flatness")
        at.line("scratch")
        at.press("Enter")  # no nonconformance
        page.evaluate(DROP, [137, 80, 78, 71])
        at.wait_for("a_crack.png")
        at.press("Enter", "Enter")
        at.wait_for("Note saved")
        (kept,) = (tmp_path / "home").rglob("notes/a_crack.png")
        assert kept.read_bytes() == bytes([137, 80, 78, 71])
        touch("z")
        at.wait_for(r"Undone \d")
        dark = page.screenshot()
        touch("F12")
        at.wait_for(r"Undone \d")  # all is drawn again, in other colours
        assert page.screenshot() != dark
        touch("Enter")
        at.wait_for("Height 1")
        at.line("0 1 2 1 0 1 2 1")
        at.wait_for("✓ pass|✗ fail")
        touch("F7")
        at.wait_for("Plot 1 of")
        touch("PageDown")
        at.wait_for("Plot 2 of")
        touch("Backspace")
        at.wait_for("Plot 1 of")
        touch("PageDown", "ArrowLeft")
        at.wait_for("Plot 1 of")
        with page.context.expect_page() as opened:
            touch("F2")
        opened.value.wait_for_load_state()
        assert opened.value.evaluate("document.documentElement.tagName.toLowerCase()") == "svg"
        assert opened.value.locator("svg text, svg path").count() > 10
        chromium.close()


def assert_a_glove_hits_each_key(page) -> None:
    """Each is inside the window, 48 pixels high and wide (10 mm and more: WCAG 2.2 asks for 24, gloves for 48), and
    covers neither another nor the terminal."""
    window, touched = page.viewport_size, page.locator("#touch button")
    places = [touched.nth(n).bounding_box() for n in range(touched.count())]
    screen = page.locator("#terminal").bounding_box()
    for place in places:
        assert min(place["height"], place["width"]) >= 48
        assert place["x"] >= 0
        assert place["x"] + place["width"] <= window["width"]
        assert place["y"] + place["height"] <= window["height"]
        assert place["y"] >= screen["y"] + screen["height"]
    assert len({(place["x"], place["y"]) for place in places}) == len(places)
    assert screen["height"] > 500


def measure(at: Browser) -> None:
    for title, count in (("Flatness", 8), ("Capacitance", 2)):
        opened(at, title)
        for _ in range(count):
            at.reads()
        back(at)
    steps = FILES if SOAK else {title: FILES[title] for title in ("Stroke", "Axial stiffness")}
    for title, files in steps.items():
        opened(at, title)
        if title in ("Stroke", "Axial stiffness"):
            at.wait_for(r"\^F: values")  # the step opens with what is there
        for entry in (*files, *(["6.4 kg"] if title == "Axial stiffness" else [])):
            at.line(entry)
            at.saved()
        back(at)
    if SOAK:
        opened(at, "Frequency responses")
        for file in ("frf_sweep.mat", "frf_noise_hf.mat"):
            at.line(file)
            at.saved()
        back(at)


def opened(at: Browser, title: str) -> None:
    at.press("Enter")
    at.wait_for(title)


def back(at: Browser) -> None:
    at.wait_for(r"✓ pass|✗ fail|\? no result|~ conditional")
    at.press("Escape")
    at.wait_for("Enter: open the step")


def sign(at: Browser) -> None:
    at.press("F9")
    at.wait_for(r"\^S: sign this result")
    at.press("F2")
    at.wait_for("Repeat passphrase")
    asked = "Why it is signed" in at.text[at.seen :]  # of a unit that is not accepted
    if asked:
        at.line("not put right")
    at.line("correct horse")
    at.line("correct horse")
    at.wait_for("Training: what is wrong with this unit")
    at.press("Escape")
    at.wait_for("Training: what this unit had")
    at.press("Escape")
    at.wait_for("verified")
