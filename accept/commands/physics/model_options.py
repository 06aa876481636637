"""Options of `accept model`, declared once. Light, so that help comes at once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from accept.commands.options import Csv, Json, Mat, ModelName, Plot, StartModelName, Uff

FirstHz = Annotated[float, Option("--f-lo", help="First frequency [Hz].")]
LastHz = Annotated[float, Option("--f-hi", help="Last frequency [Hz].")]


@dataclass(frozen=True)
class ModesOptions:
    """Which poles and zeros are listed."""

    model: ModelName = "strut"
    f_max: Annotated[float, Option("--f-max", help="Highest frequency listed [Hz].")] = 2000.0
    clamped: Annotated[bool, Option("--clamped", help="With the payload held: the spurious modes.")] = False
    json: Json = None


@dataclass(frozen=True)
class FrfOptions:
    """Frequencies of modelled responses, and their files."""

    model: ModelName = "strut"
    f_lo: FirstHz = 10.0
    f_hi: LastHz = 2000.0
    points: Annotated[int, Option(help="Frequencies, evenly over log f.")] = 1000
    json: Json = None
    csv: Csv = None
    mat: Mat = None
    uff: Uff = None
    plot: Plot = None


@dataclass(frozen=True)
class FitOptions:
    """The start model of a fit, and its frequency band."""

    model: StartModelName = None
    f_lo: Annotated[float, Option("--f-lo", help="First frequency fitted [Hz].")] = 10.0
    f_hi: Annotated[float, Option("--f-hi", help="Last frequency fitted [Hz].")] = 2000.0
    starts: Annotated[int, Option(min=1, help="Starts of the search.")] = 3


@dataclass(frozen=True)
class FitOutputs:
    """Files of a fit; out: all three of them in a folder."""

    out: Annotated[Path | None, Option(help="Folder for model.toml, fit.pdf and fit.json.")] = None
    write: Annotated[Path | None, Option(help="The fitted model as a file.")] = None
    plot: Plot = None
    json: Json = None

    def places(self) -> tuple[Path | None, Path | None, Path | None]:
        """Return model file, picture, JSON."""
        if self.out is None:
            return self.write, self.plot, self.json
        return (
            self.write or self.out / "model.toml",
            self.plot or self.out / "fit.pdf",
            self.json or (self.out / "fit.json"),
        )


@dataclass(frozen=True)
class ParameterSweepOptions:
    """Values of a sweep, and files of its poles and zeros. values: None for the published ones."""

    values: Annotated[list[float] | None, Option("--value", help="A value; repeat for more.")] = None
    channel: Annotated[str, Option(help="Vs, de or da.")] = "de"
    model: ModelName = "strut"
    f_hi: LastHz = 800.0
    json: Json = None
    plot: Plot = None
