"""The figures of the pages that explain the physics: `make pictures` computes them with the project's own models,
simulation and checks, and writes them small.

Run by hand: `python tests/shared/explanation_figures.py docs/img/physics`.
"""

import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
import accept
from accept.models.model_file import open_model
from accept.pictures.draw import picture
from accept.pictures.reduce import reduce_panel
from accept.simulate import UnitRequest, simulate, write
from checks.picture import Line, Panel, PanelKind

SIZE_MM = (88.0, 62.0)
DOTS = 110.0  # per inch: an eighth of a megabyte for all figures
F = np.geomspace(10.0, 700.0, 1400)


def main() -> None:
    out = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as place:
        os.environ["ACCEPT_HOME"] = place
        for name, panels in figures(Path(place)):
            width, height = SIZE_MM
            content = picture(
                [reduce_panel(p) for p in panels], "png", (width * len(panels), height), columns=len(panels), dots=DOTS
            )
            (out / f"{name}.png").write_bytes(content)
            print(out / f"{name}.png", len(content))


def figures(place: Path) -> Iterator[tuple[str, list[Panel]]]:
    """Name, panels beside each other."""
    sound, dead = (judged(place / name, name, fault) for name, fault in (("sound", None), ("dead", "dead_stack")))
    yield (
        "stroke",
        [
            replace(sound["stroke/loops"], title="All stacks work"),
            replace(dead["stroke/loops"], title="One stack is dead"),
        ],
    )
    yield "hysteresis", [sound["hysteresis/displacement_loops"], sound["hysteresis/displacement_width"]]
    yield "stiffness", [sound["stiffness/closed_circuit"], sound["stiffness/open_circuit"]]
    yield "highpass", [sound["sensor_highpass/magnitude"], sound["frf/coherence"]]
    yield "apa", [sound["frf/de magnitude"], sound["frf/Vs magnitude"]]
    yield "strut-dy", strut("dy", (-500.0, -100.0, 0.0, 100.0, 500.0))
    yield "strut-dx", strut("dx", (-100.0, -50.0, 0.0, 50.0, 100.0))


def judged(folder: Path, serial: str, fault: str | None) -> Mapping[str, Panel]:
    """Pictures of the checks of a simulated APA."""
    made = simulate(UnitRequest(serial, "apa", open_model("apa-frame"), seed=1, fault=fault))
    return accept.judge(write(made, folder), "apa").panels


def strut(along: str, values: tuple[float, ...]) -> list[Panel]:
    """Encoder and interferometer of a strut whose APA lies beside the joints' axis."""
    model = open_model("strut")
    rows = [(v, model.frf(F, {f"misalignment.{along}_um": v}, ("de", "da"))) for v in values]
    return [response(name, [(f"{along} = {v:g} um", H[:, c]) for v, H in rows]) for c, name in enumerate(("de", "da"))]


def response(name: str, curves: list[tuple[str, np.ndarray]]) -> Panel:
    unit = "V/V" if name == "Vs" else "m/V"
    lines = tuple(Line(F, np.abs(H), label) for label, H in curves)
    y_label = f"|{name} / Va| [{unit}]"
    return Panel(f"{name} / Va", "frequency [Hz]", y_label, lines, True, True, kind=PanelKind.RESPONSE)


if __name__ == "__main__":
    main()
