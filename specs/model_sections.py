"""The sections of a model file. A number may be a value or `{ value, sd }`; with an sd it is uncertain."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model, model_validator

from specs.models.parameters import CHANNELS, PARAMETERS, of_section
from specs.strict import Finite, NotNegative, Positive, Strict, Words

BENDING = ("kRx_Nm_per_rad", "kRy_Nm_per_rad")
TYPES = {"2dof": BENDING, "3dof": (*BENDING, "kRz_Nm_per_rad"), "4dof": (*BENDING, "kRz_Nm_per_rad", "kz_N_per_um")}


class Value(Strict):
    """A number, with the standard deviation of its prior if it is uncertain."""

    value: Finite
    sd: Positive | None = None


def _as_value(entry: Any) -> Any:
    return entry if isinstance(entry, dict | Value) else {"value": entry}


Number = Annotated[Value, BeforeValidator(_as_value)]


KEYS = {p.key: p.keys for p in PARAMETERS if p.each}


class NodesSection(Strict):
    """Interface nodes, counted from 1 in the file's order."""

    bottom: Annotated[int, Field(ge=1)]
    top: Annotated[int, Field(ge=1)]
    sensor: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)]
    actuator: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)]


class MatrixNames(Strict):
    """The names of the matrices in a .mat file."""

    K: Words = "K"
    M: Words = "M"
    int_xyz: Words = "int_xyz"


class ByChannel(Strict):
    """One number for each channel that has one."""

    Vs: Number | None = None
    de: Number | None = None
    da: Number | None = None


class ModelSection(Strict):
    """A section whose numbers become parameters."""

    def numbers(self) -> Iterator[tuple[str, Value]]:
        for key, held in self:
            if isinstance(held, Value):
                yield key, held
            elif isinstance(held, list) and held and isinstance(held[0], Value):
                yield from zip(self.listed(key)[: len(held)], held, strict=True)
            elif isinstance(held, ByChannel):
                of_channels = zip(self.listed(key), (getattr(held, c) for c in CHANNELS), strict=True)
                yield from ((name, number) for name, number in of_channels if number is not None)

    def listed(self, key: str) -> Sequence[str]:
        """Return the names of the numbers under one key."""
        return KEYS[key]


def _numbers(*sections: str) -> Any:
    """Return a section of a model file with the parameters that are declared for it."""
    fields: dict[str, Any] = {}
    for p in of_section(*sections):
        kind: Any = Number
        if p.each:
            kind = ByChannel if p.each == CHANNELS else Annotated[list[Number], Field(min_length=3, max_length=3)]
        if p.needed:
            fields[p.key] = kind, ...
        elif p.default is not None:
            fields[p.key] = kind, Field(default_factory=partial(Value, value=p.default))
        else:
            fields[p.key] = (kind, Field(default_factory=ByChannel)) if p.each else (kind | None, None)
    return create_model("".join(sections).title(), __base__=ModelSection, **fields)


MOST_MODES = 1000  # fifteen times those of an APA300ML below 30 kHz


class ModeScatter(Strict):
    """Scatter of an APA's free elastic modes from unit to unit: 1 sd, relative, of each frequency and damping ratio."""

    frequency: Annotated[float, Field(ge=0, le=0.2, allow_inf_nan=False)]
    damping: Annotated[float, Field(ge=0, le=1.0, allow_inf_nan=False)]


class ApaOfModes(_numbers("apa", "apa of modes")):  # type: ignore[misc]
    """An APA with free elastic modes. mode_stiffness, mode_damping: factors on stiffness and damping of the first
    modes, by rising frequency, as far as known; with a sd of their own or that of the scatter."""

    mode_scatter: ModeScatter | None = None
    mode_stiffness: Annotated[list[Number], Field(max_length=MOST_MODES)] = Field(default_factory=list)
    mode_damping: Annotated[list[Number], Field(max_length=MOST_MODES)] = Field(default_factory=list)

    @model_validator(mode="after")
    def _factors_of_what_scatters(self) -> "ApaOfModes":
        if self.mode_scatter is None and (self.mode_stiffness or self.mode_damping):
            raise ValueError("mode_stiffness and mode_damping need mode_scatter")
        return self

    def listed(self, key: str) -> Sequence[str]:
        return [f"{key}_{k + 1}" for k in range(MOST_MODES)]


class Apa2dof(_numbers("apa", "2dof")):  # type: ignore[misc]
    """An APA of springs and dampers."""

    type: Literal["2dof"]


class ApaFrame(ApaOfModes):
    """The parametric frame; `geometry` replaces entries of its geometry, by their names in the code, in SI units."""

    type: Literal["frame"]
    geometry: dict[str, Any] = Field(default_factory=dict)


class ApaSuperelement(ApaOfModes):
    """An APA of matrices in a file ([DESIGN] 5)."""

    type: Literal["superelement"]
    file: Words
    nodes: NodesSection
    names: MatrixNames = Field(default_factory=MatrixNames)


class JointSection(_numbers("joint")):  # type: ignore[misc]
    """One flexible joint. type: `2dof` bends, `3dof` twists too, `4dof` also gives along the axis; lateral springs kx,
    ky are added if they are named. Directions that it does not name are rigid."""

    type: Literal["2dof", "3dof", "4dof"]

    @model_validator(mode="after")
    def _springs_of_its_type(self) -> "JointSection":
        wanted = TYPES[self.type]
        for key in TYPES["4dof"]:
            if (getattr(self, key) is not None) != (key in wanted):
                raise ValueError(f"a joint of type '{self.type}' {'needs' if key in wanted else 'has no'} {key}")
        return self


class EncoderSection(_numbers("encoder")):  # type: ignore[misc]
    """Head and ruler as bodies."""


class BenchSection(_numbers("bench")):  # type: ignore[misc]
    """The bench: payload, guide and its own effects."""


class Misalignment(_numbers("misalignment")):  # type: ignore[misc]
    """Offsets of the APA."""


class DelaySection(_numbers("delay")):  # type: ignore[misc]
    """Delay."""


class Amplifier(_numbers("amplifier")):  # type: ignore[misc]
    """The amplifier, which is infinitely fast without either bandwidth."""


class Sensor(_numbers("sensor")):  # type: ignore[misc]
    """The circuit of the sensor stack."""


class Joints(Strict):
    """Two joints that differ."""

    bottom: JointSection
    top: JointSection


class Constants(_numbers("constants")):  # type: ignore[misc]
    """gs in volts per elongation of the sensor stack, or for a 2-DoF APA in volts per newton in ke."""

    @model_validator(mode="after")
    def _one_gs(self) -> "Constants":
        if (self.gs_V_per_m is None) == (self.gs_V_per_N is None):
            raise ValueError("needs exactly one of gs_V_per_m and gs_V_per_N")
        return self


class Tolerance(Strict):
    """relative: an error of the model too small to matter, in parts of the response. least: if the APA's modes are
    uncertain, the tolerance of a fit falls as far as the data bear it, but not below this; up_to_Hz: nothing is
    compared with the model above."""

    relative: Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)] = 0.0
    least: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 3e-4
    up_to_Hz: Annotated[float, Field(gt=0, le=5000.0, allow_inf_nan=False)] = 5000.0


class ElementEntry(ModelSection):
    """An element attached along one direction of a place. covariance: of its numbers with an sd, in their order."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, Number]
    place: Words
    direction: Literal["x", "y", "z", "Rx", "Ry", "Rz"]
    kind: Words | None = None
    covariance: list[list[Finite]] = Field(default_factory=list)


class EffectEntry(BaseModel):
    """An effect added to the model, in order: its name and its parameters, which its own code checks."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)
    name: Words

    @property
    def parameters(self) -> dict[str, Any]:
        return dict(self.model_extra or {})


def _check_unique(names: Sequence[str]) -> None:
    """Raise ValueError naming a parameter that occurs twice."""
    twice = [name for n, name in enumerate(names) if name in names[:n]]
    if twice:
        raise ValueError(f"names: '{twice[0]}' occurs twice")


class FitRecord(Strict):
    """The origin of fitted values: their names and covariance in the names' units, the unit and its files, and the
    model that was fitted. G: of every channel after the fit; G_not_fitted: on another realisation; doubt: why the
    values are not to be taken for the unit's."""

    names: Annotated[list[Words], Field(min_length=1)]
    covariance: list[list[Finite]]
    model: Words
    model_sha256: Words
    serial: Words | None = None
    inputs: dict[str, Words] = Field(default_factory=dict)
    G: dict[str, Finite] = Field(default_factory=dict)
    G_not_fitted: dict[str, Finite] = Field(default_factory=dict)
    doubt: Words | None = None

    @model_validator(mode="after")
    def _square(self) -> "FitRecord":
        p = len(self.names)
        _check_unique(self.names)
        if len(self.covariance) != p or any(len(row) != p for row in self.covariance):
            raise ValueError(f"covariance: expected {p} rows of {p} numbers, one for each name")
        for i, name in enumerate(self.names):
            if not self.covariance[i][i] > 0:
                raise ValueError(f"covariance of {name} with itself is {self.covariance[i][i]:g}, expected above 0")
        return self


class BenchOfChannel(Strict):
    """A learned bench on one channel, a number for each frequency: real and imaginary part of its factor less one, the
    standard uncertainty of that, and 1 sd of the deviation of one more unit."""

    real: list[Finite]
    imag: list[Finite]
    sd: list[NotNegative]
    tolerance: list[NotNegative]


class LearnedBenchRecord(Strict):
    """The unexplained factor of the bench on every unit, learned from units. units: their serials; apart: those left
    out; learned_on: the day, in ISO 8601."""

    f_Hz: Annotated[list[Positive], Field(min_length=2)]
    channels: dict[Literal["Vs", "de", "da"], BenchOfChannel]
    units: list[Words]
    apart: list[Words] = Field(default_factory=list)
    learned_on: Words | None = None

    @model_validator(mode="after")
    def _one_number_for_each_frequency(self) -> "LearnedBenchRecord":
        if any(b <= a for a, b in pairwise(self.f_Hz)):
            raise ValueError("f_Hz: expected frequencies that rise")
        for channel, of_channel in self.channels.items():
            for key, numbers in of_channel:
                if len(numbers) != len(self.f_Hz):
                    raise ValueError(
                        f"channels.{channel}.{key}: has {len(numbers)} entries, expected one for each of "
                        f"{len(self.f_Hz)} frequencies"
                    )
        return self


class PopulationRecord(Strict):
    """The prediction of a batch for one more unit: mean and covariance of the named parameters in the names' units, the
    prior of every fit of such a unit. covariance: row i has the entries with the names 0 .. i. scatter: 1 sd from unit
    to unit; mean_sd: standard uncertainty of the mean; both for people. units: serials that it was learned from; apart:
    those that did not belong. model, model_sha256: the model that was used for learning. holds_together: whether enough
    of them belong to one batch; if not, nothing opens the file."""

    names: Annotated[list[Words], Field(min_length=1)]
    mean: list[Finite]
    scatter: list[Positive]
    mean_sd: list[Positive]
    covariance: list[list[Finite]]
    units: list[Words]
    apart: list[Words] = Field(default_factory=list)
    model: Words
    model_sha256: Words
    holds_together: bool = True

    @model_validator(mode="after")
    def _shapes(self) -> "PopulationRecord":
        p = len(self.names)
        _check_unique(self.names)
        for key in ("mean", "scatter", "mean_sd", "covariance"):
            if len(getattr(self, key)) != p:
                raise ValueError(f"{key}: has {len(getattr(self, key))} entries, expected one for each of {p} names")
        for i, (name, row) in enumerate(zip(self.names, self.covariance, strict=True)):
            if len(row) != i + 1:
                raise ValueError(f"covariance: row {i + 1} has {len(row)} numbers, expected {i + 1}")
            if not row[i] > 0:
                raise ValueError(f"covariance of {name} with itself is {row[i]:g}, expected above 0")
        return self

    @property
    def full(self) -> list[list[float]]:
        """Return the covariance with its upper half."""
        rows = self.covariance
        return [[rows[max(i, j)][min(i, j)] for j in range(len(rows))] for i in range(len(rows))]
