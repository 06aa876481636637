"""Scales of channels that a unit's own file states: what multiplies a measurement decides its finding."""

from accept.judging.calibration import Statement, stated_scales
from accept.units.unit_folder import UnitFolder
from checks.acceptance import CHECKS
from checks.cause import Cause, Reason, because, together
from checks.declare import Series
from specs.bench import ChannelSource
from specs.spec import Spec


def scale_doubts(unit: UnitFolder, spec: Spec, stated: Statement | None) -> dict[str, Reason]:
    """Return check -> which channels of its records `[channels]` of unit.toml scales otherwise than the bench file
    states. An editor can choose that number, so it supports no acceptance by itself."""
    known = (stated or {}).get("channels", {})
    own = {
        name: unit.channels[name] for name, scale in stated_scales(unit.channels).items() if known.get(name) != scale
    }
    found = {}
    for check in spec.checks:
        section = unit.sections.get(CHECKS[check].reads)
        names = [] if section is None else [n for n in own if n in _channels_of(CHECKS[check].reads)]
        if names:
            found[check] = together([_reason(name, own[name]) for name in names])
    return found


def _channels_of(section: str) -> set[str]:
    series = [i for i in CHECKS[section].inputs.values() if isinstance(i, Series)]
    return {name for one in series for name in (*one.channels, *one.optional_channels)}


def _reason(name: str, source: ChannelSource) -> Reason:
    words = [f"is multiplied by {source.gain:g}"] if source.gain != 1.0 else []
    words += [f"is taken in {source.unit}"] if source.unit else []
    return because(Cause.CHANNEL_SCALED, channel=name, how=" and ".join(words))
