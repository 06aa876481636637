"""Writes the page: index.html, its style and script, the data, and the plotting library beside them."""

from collections.abc import Mapping
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from accept.base.atomic_files import write_atomic
from accept.fleet.errors import FleetError
from accept.fleet.site.page_data import script
from specs.distribution import install

OWN = ("index.html", "style.css", "page.js")
LIBRARY = "plotly.min.js"


def write_site(out: Path, content: Mapping[str, Any]) -> list[Path]:
    """Write the page into `out` and return its files. Raises FleetError if the extra `site` is not installed."""
    if find_spec("plotly") is None:
        raise FleetError(f"the page needs plotly: {install('site')}")
    if not content["judgements"]:
        raise FleetError("no unit has been judged yet: there is nothing to show")
    files = {name: resources.files("accept.fleet.site").joinpath(name).read_bytes() for name in OWN}
    files[LIBRARY] = resources.files("plotly").joinpath("package_data", LIBRARY).read_bytes()
    files["fleet.js"] = script(content).encode("ascii")
    for name, data in files.items():
        write_atomic(out / name, data)
    return [out / name for name in files]
