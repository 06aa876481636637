"""Pictures as data: a check states the contents, each medium (PDF, PNG, terminal) draws them in its own way."""

from dataclasses import dataclass
from enum import StrEnum

from checks.arrays import Array


@dataclass(frozen=True, eq=False)
class Line:
    """Curve through x (N,), y (N,). style: "solid", "dashed" or "points"; role picks the colour:
    "data", "model", "before", "good", "bad", "limit", "quiet", or "auto" for the next of a series."""

    x: Array
    y: Array
    label: str = ""
    style: str = "solid"
    role: str = "auto"


@dataclass(frozen=True, eq=False)
class Band:
    """Shaded area between lo (N,) and hi (N,) over x (N,)."""

    x: Array
    lo: Array
    hi: Array
    label: str = ""
    role: str = "quiet"


@dataclass(frozen=True)
class Span:
    """Shaded interval of an axis, e.g. a limit zone or a band that is not trusted."""

    lo: float
    hi: float
    axis: str = "x"
    label: str = ""
    role: str = "quiet"


@dataclass(frozen=True)
class Mark:
    """Straight line across the panel at one value of an axis."""

    at: float
    axis: str = "x"
    label: str = ""
    role: str = "limit"


@dataclass(frozen=True)
class Text:
    """Words at a point of the panel."""

    x: float
    y: float
    words: str
    role: str = "data"


@dataclass(frozen=True, eq=False)
class Heights:
    """Heights z (N,) measured at (x, y), drawn as coloured, numbered points over their plane view."""

    x: Array
    y: Array
    z: Array
    label: str = ""


@dataclass(frozen=True, eq=False)
class Image:
    """Regular map z (len(y), len(x)), e.g. a likelihood over two parameters."""

    x: Array
    y: Array
    z: Array
    label: str = ""


Item = Line | Band | Span | Mark | Text | Heights | Image


class PanelKind(StrEnum):
    """Kind of a panel, for code that chooses among panels: fleets compare responses and overlay curves."""

    RESPONSE = "response"
    PHASE = "phase"
    COHERENCE = "coherence"
    CURVE = "curve"
    OTHER = ""


@dataclass(frozen=True, eq=False)
class Panel:
    """One set of axes."""

    title: str
    x_label: str
    y_label: str
    items: tuple[Item, ...]
    x_log: bool = False
    y_log: bool = False
    equal: bool = False  # same scale on both axes
    y_range: tuple[float, float] | None = None
    x_range: tuple[float, float] | None = None  # so that panels that stand below each other share their axis
    y_names: tuple[str, ...] = ()  # in place of the numbers 0, 1, ... of the y axis
    kind: PanelKind = PanelKind.OTHER
