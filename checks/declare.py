"""Declaration of a check, in one place: its inputs, its quantities and the function that measures.

The reader of `unit.toml`, the form in the workflow, the validation of a spec and the documentation all come from here.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from checks.cause import declare_record
from checks.quantity import Outcome
from specs.spec import CheckSpec
from specs.units import label_from_name, unit_of


@dataclass(frozen=True)
class Scalar:
    """Number in the unit that its name gives. lo, hi: plausible range; an entry outside it is refused. usual: a value
    outside it is asked about, since a power of ten or another unit is easily mistyped."""

    name: str
    label: str
    lo: float = -math.inf
    hi: float = math.inf
    optional: bool = False
    default: float | None = None
    usual: tuple[float, float] | None = None

    @property
    def unit(self) -> str:
        return unit_of(self.name)


@dataclass(frozen=True)
class Vector:
    """Fixed number of values in the unit that the name gives, typed or taken in a stated order. item: the name of one
    value; usual: as of a scalar; called: its name in sentences."""

    name: str
    label: str
    size: int
    optional: bool = False
    item: str = "value"
    usual: tuple[float, float] | None = None
    called: str = ""
    named: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.called:
            declare_record(self.name, self.called)

    @property
    def unit(self) -> str:
        return unit_of(self.name)


@dataclass(frozen=True)
class CsvTable:
    """A CSV file with these columns and at least `min_rows` rows."""

    name: str
    label: str
    columns: tuple[str, ...]
    min_rows: int = 1
    optional: bool = False


@dataclass(frozen=True)
class Series:
    """A record file with these channels (name -> unit). `step`: the name of a scalar that holds the sampling time
    when the file has no time vector. `optional_channels` are read if the file has them. called: its name in
    sentences ("torsion, hit at the left"), else `name`. named: words, beside those of `name`, that the names of its
    files usually hold. instead: channel -> the one to read where a product does not have it. beside: the channel
    without which a product has no such record. absent: channels that the product does not have, with their units."""

    name: str
    label: str
    channels: Mapping[str, str]
    optional: bool = False
    optional_channels: Mapping[str, str] = field(default_factory=dict)
    step: str | None = None
    called: str = ""
    named: tuple[str, ...] = ()
    instead: Mapping[str, str] = field(default_factory=dict)
    beside: str = ""
    absent: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.called:
            declare_record(self.name, self.called)

    def without(self, absent: Collection[str]) -> "Series":
        """Return the record of a product that does not have these channels."""
        named = {self.instead.get(c, "") if c in absent else c: unit for c, unit in self.channels.items()}
        lost = {c: unit for c, unit in self.channels.items() if c in absent}
        return replace(self, channels={c: unit for c, unit in named.items() if c}, absent=lost)


Input = Scalar | Vector | CsvTable | Series


@dataclass(frozen=True)
class Measured:
    """A typed value with the expanded uncertainty stated beside it (None: the spec states it)."""

    value: float
    U: float | None = None


Values = Mapping[str, Any]
"""What a check receives: input name -> Measured (Scalar), (size,) array (Vector), column -> (N,) array (Table), Record
(Series). An input that was not given is absent."""


@dataclass(frozen=True)
class Form:
    """One way of giving a check its data; a section of `unit.toml` must fit exactly one form of its check."""

    name: str
    inputs: tuple[Input, ...]


@dataclass(frozen=True)
class Setting:
    """A number or list that a spec may set for a check under `settings`, with its default and its meaning. positive:
    whether it, or each of its numbers, must be above zero."""

    name: str
    default: Any
    meaning: str
    positive: bool = False


@dataclass(frozen=True)
class Guide:
    """Instructions for the technician at a check's step. words: two sentences; picture: lines of a drawing, at most 33
    columns wide; drive: who starts it, and at which amplitude; "" if no drive is needed. pictures_without: channel ->
    the drawing for products that do not have it. lit: input -> what of the drawing is in use while it is measured."""

    words: str
    picture: str = ""
    drive: str = ""
    pictures_without: Mapping[str, str] = field(default_factory=dict)
    lit: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def without(self, absent: Mapping[str, str]) -> "Guide":
        """Return the instructions for a product that does not have these channels: each with the reason."""
        why = "".join(f" {words[0].upper()}{words[1:]}." for words in absent.values())
        picture = next((self.pictures_without[c] for c in absent if c in self.pictures_without), self.picture)
        return replace(self, words=f"{self.words}{why}", picture=picture)


@dataclass(frozen=True)
class Check:
    """One acceptance check. `name` is its section in a spec, and in `unit.toml` unless `section` names another's.

    measure : (values, spec of this check) -> Outcome holding every name of `quantities` once (a quantity that could not
    be measured is present with its reason); raises NoResult if nothing could be measured.
    quantities : name -> label of the quantity; a name ends in its unit, a label is used in tables and sentences.
    Without a label the words are made from the name.
    section : the check whose data this one reads too; its forms are then those of that check.
    model : the setting that names a model; the check finds the loaded model among its values, as `model`.
    guide : instructions that the workflow shows at its step; made from the declaration if the check gives none.
    short : its name in a list, at most 16 letters; the beginning of the title if the check gives none.
    failed : what to do first if a quantity is beyond its limits, before the part is blamed.
    """

    name: str
    title: str
    kinds: tuple[str, ...]
    forms: tuple[Form, ...]
    quantities: Collection[str]
    measure: Callable[[Values, CheckSpec], Outcome]
    settings: tuple[Setting, ...] = ()
    stated: tuple[str, ...] = ()  # names whose uncertainty a spec may state
    section: str | None = None
    model: str | None = None
    guide: Guide | None = None
    short: str = ""
    failed: str = ""

    @property
    def labels(self) -> dict[str, str]:
        given = self.quantities if isinstance(self.quantities, Mapping) else {}
        return {name: given.get(name) or label_from_name(name) for name in self.quantities}

    @property
    def reads(self) -> str:
        """Return the section of `unit.toml` that holds its data."""
        return self.section or self.name

    @property
    def inputs(self) -> dict[str, Input]:
        return {i.name: i for form in self.forms for i in form.inputs}

    def without(self, absent: Mapping[str, str]) -> "Check":
        """Return the check for a product that does not have these channels: each with the reason."""
        kept = [[i for i in form.inputs if not (isinstance(i, Series) and i.beside in absent)] for form in self.forms]
        bare = [[i.without(absent) if isinstance(i, Series) else i for i in inputs] for inputs in kept]
        forms = tuple(replace(form, inputs=tuple(inputs)) for form, inputs in zip(self.forms, bare, strict=True))
        lost = {c for inputs in bare for i in inputs if isinstance(i, Series) for c in i.absent}
        if not lost:
            return self
        reasons = {c: why for c, why in absent.items() if c in lost}
        return replace(self, forms=forms, guide=None if self.guide is None else self.guide.without(reasons))
