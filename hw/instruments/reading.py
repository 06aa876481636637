"""What an instrument tells: a reading in SI, and who it says it is."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from hw.errors import Implausible, WrongInstrument


@dataclass(frozen=True)
class Reading:
    """value in `unit` (SI: "m", "F"); t: when it came [s since 1970]; raw: the replies it was read from, in order;
    more: what came with it (D of a capacitance), dimensionless."""

    value: float
    unit: str
    t: float
    raw: tuple[bytes, ...]
    more: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Identity:
    """What the instrument says it is; None: its protocol does not tell, or it was not asked."""

    model: str | None = None
    serial: str | None = None
    firmware: str | None = None


def check_identity(who: str, said: Identity, model: str | None, serial: str | None) -> None:
    """Raises WrongInstrument where the instrument says another model or serial number than the bench file."""
    for name, found, expected in (("model", said.model, model), ("serial number", said.serial, serial)):
        if found is not None and expected is not None and found != expected:
            words = "are two instruments swapped?"
            raise WrongInstrument(f"{who}: the instrument says {name} {found!r}, the bench file {expected!r}; {words}")


def agreed(who: str, first: Reading, second: Reading, within: float) -> Reading:
    """Their mean, at the time of the second. Raises Implausible when they differ by more than `within` [SI].

    A serial line without checksum cannot tell 12.3 from a damaged 18.3; two answers to two questions can.
    """
    difference = abs(first.value - second.value)
    if not difference <= within:
        raise Implausible(
            f"{who}: two readings in a row differ by {difference:.3g} {first.unit} ({first.raw[-1]!r}, "
            f"{second.raw[-1]!r}), at most {within:.3g} are allowed; is something moving, or the line disturbed?"
        )
    mean = (first.value + second.value) / 2
    return Reading(mean, first.unit, second.t, first.raw + second.raw, second.more)
