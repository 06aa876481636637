"""A model file: the parts of a strut on its bench, read strictly from TOML ([DESIGN] 5).

Every number may be a value or `{ value, sd }`; with an sd it is uncertain and gets calibrated. A parameter's flat name
is its section and key, `joint.kz_N_per_um`, so a file and a dictionary of values say the same."""

from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from specs.model_sections import (
    Amplifier,
    Apa2dof,
    ApaFrame,
    ApaSuperelement,
    BenchSection,
    Constants,
    DelaySection,
    EffectEntry,
    ElementEntry,
    EncoderSection,
    FitRecord,
    Joints,
    JointSection,
    LearnedBenchRecord,
    Misalignment,
    ModelSection,
    PopulationRecord,
    Sensor,
    Tolerance,
)
from specs.strict import Strict, Words, file_bytes, file_named, parse_as


class ModelDocument(Strict):
    """The TOML document of a model."""

    name: Words
    damping: Literal["full", "modal"] = "full"
    apa: Annotated[Apa2dof | ApaFrame | ApaSuperelement, Field(discriminator="type")]
    joint: JointSection | Joints | None = None
    encoder: EncoderSection | None = None
    bench: BenchSection
    constants: Constants
    misalignment: Misalignment = Field(default_factory=Misalignment)
    delay: DelaySection = Field(default_factory=DelaySection)
    amplifier: Amplifier = Field(default_factory=Amplifier)
    sensor: Sensor = Field(default_factory=Sensor)
    tolerance: Tolerance = Field(default_factory=Tolerance)
    effects: list[EffectEntry] = Field(default_factory=list)
    elements: list[ElementEntry] = Field(default_factory=list)
    fit: FitRecord | None = None
    population: PopulationRecord | None = None
    learned_bench: LearnedBenchRecord | None = None

    @model_validator(mode="before")
    @classmethod
    def _joint_of_one_kind(cls, data: Any) -> Any:
        """Choose the kind of joint, so that a wrong key is reported once and not once for each alternative."""
        joint = data.get("joint") if isinstance(data, dict) else None
        if isinstance(joint, dict):
            kind = Joints if joint.keys() & {"bottom", "top"} else JointSection
            return {**data, "joint": kind.model_validate(joint)}
        return data

    @model_validator(mode="after")
    def _parts_fit(self) -> "ModelDocument":
        if self.encoder is not None and self.joint is None:
            raise ValueError("[encoder] without [joint]: the bench's own encoder reads an APA that is alone")
        if self.constants.gs_V_per_N is not None and self.apa.type != "2dof":
            raise ValueError("[constants] gs_V_per_N is for apa.type '2dof'; give gs_V_per_m")
        at = [(e.place, e.direction) for e in self.elements]
        if len(at) > len(set(at)):
            raise ValueError("elements: a place has two entries along one direction; expected one")
        return self

    def sections(self) -> Iterator[tuple[str, ModelSection]]:
        """Yield sections with numbers, each by the prefix of its parameters' flat names."""
        named: dict[str, ModelSection | None] = {"apa": self.apa}
        if isinstance(self.joint, Joints):
            named |= {"joint.bottom": self.joint.bottom, "joint.top": self.joint.top}
        else:
            named |= {"joint": self.joint}
        rest = ("encoder", "bench", "constants", "misalignment", "delay", "amplifier", "sensor")
        named |= {name: getattr(self, name) for name in rest}
        yield from ((name, section) for name, section in named.items() if section is not None)
        yield from ((f"element.{e.place}.{e.direction}", e) for e in self.elements)

    @property
    def values(self) -> dict[str, float]:
        """Return flat name -> value of every number of the file, defaults among them."""
        return {f"{s}.{key}": v.value for s, section in self.sections() for key, v in section.numbers()}

    @property
    def sds(self) -> dict[str, float]:
        """Return flat name -> prior standard deviation of the uncertain numbers, in the file's units."""
        return {
            f"{s}.{key}": v.sd for s, section in self.sections() for key, v in section.numbers() if v.sd is not None
        }


class ModelSpec(ModelDocument):
    """A model file with its bytes. `apa.file` is relative to `folder`."""

    sha256: str
    text: str
    folder: str

    @property
    def apa_file(self) -> Path | None:
        return Path(self.folder) / self.apa.file if isinstance(self.apa, ApaSuperelement) else None


def builtin_models() -> dict[str, Path]:
    """Return name -> file of the models that come with the program."""
    return {p.stem: p for p in sorted((Path(str(resources.files("specs"))) / "models").glob("*.toml"))}


def load_model(name: str | Path) -> ModelSpec:
    """Return model by built-in name or TOML file. Raises SpecError listing every problem with its key path."""
    path = file_named(name, builtin_models(), "model")
    return parse_model(file_bytes(path), str(path), path.parent)


def parse_model(raw: bytes, path: str, folder: Path) -> ModelSpec:
    """Return model from the bytes of a TOML file; `path` is for messages. Raises SpecError."""
    return parse_as(ModelSpec, ModelDocument, raw, path, folder=str(folder))
