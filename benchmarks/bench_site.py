"""How long the page of 2,000 units takes to open in Chromium, against an empty page with the plotting library alone.

Run: python benchmarks/bench_site.py. Needs Chromium (Debian: apt install chromium).
"""

import os
import shutil
import tempfile
import time
from pathlib import Path
from statistics import median

GOAL_S = 2.0
RUNS = 5


def main() -> None:
    """Print both times and their ratio."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ACCEPT_HOME"] = str(Path(folder) / "home")
        from tests.accept.fleet.test_site import ARGUMENTS, CHROMIUM, fill, written

        if CHROMIUM is None:
            print("no Chromium: nothing measured")
            return
        fill(2000)
        index = written(Path(folder) / "site")
        bare = Path(folder) / "bare.html"
        shutil.copy(index.parent / "plotly.min.js", folder)
        bare.write_text("<body><script src='plotly.min.js'></script><script>document.body.dataset.drawn = 0</script>")
        from playwright.sync_api import sync_playwright

        with sync_playwright() as running:
            browser = running.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            times = {page: [_opened(browser, page) for _ in range(RUNS)] for page in (index, bare)}
            browser.close()
    full, empty = (median(times[page]) for page in (index, bare))
    print(f"page of 2,000 units: {full:.2f} s (goal {GOAL_S} s), library alone {empty:.2f} s, ratio {full / empty:.2f}")


def _opened(browser: object, page: Path) -> float:
    made = browser.new_page()  # type: ignore[attr-defined]
    began = time.monotonic()
    made.goto(page.as_uri())
    made.wait_for_function("document.body.dataset.drawn !== undefined")
    taken = time.monotonic() - began
    made.close()
    return taken


if __name__ == "__main__":
    main()
