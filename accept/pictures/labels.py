"""Labels of quantities and inputs for people; code names are for files and details. What loads slowly is loaded when a
label is asked for."""

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from checks.verdict import UsedInput
    from specs.bench import ChannelSource

CHANNELS = "channels."  # how the names of mapped channels begin among inputs
_LONGEST_NAME = 64  # characters of a file or of a channel in it
LONGEST_INPUTS = 3000  # characters; nine records of long names and every setting of the responses have fewer


@cache
def label_of(quantity: str) -> str:
    """Return the label that the quantity's check declares, else words from its name."""
    from checks.acceptance import CHECKS

    return CHECKS.label_of(quantity)


def check_label(check: str) -> str:
    """Return the name of a check as people read it; of one that is not installed, words from its name."""
    from checks.acceptance import CHECKS

    return (CHECKS[check].short or CHECKS[check].title) if check in CHECKS else check.replace("_", " ")


def label_and_name(quantity: str) -> str:
    """Return `Misalignment dy (dy_um)`: the label, and the code name that commands take."""
    return f"{label_of(quantity)} ({quantity})"


def inputs_words(result: Mapping[str, Any]) -> dict[str, str]:
    """Return check -> the inputs of its findings in words, by their source, of an entry of results.json:
    `unit.toml: added mass 7 kg (the spec says 6.4 kg)`. Those of earlier programs state none."""
    found = {}
    for check, inputs in stated_inputs(result).items():
        by_source: dict[str, list[str]] = {}
        for one in inputs:
            other = one.against or one.told
            words = input_words(check, one) + (f" ({other})" if other else "")
            by_source.setdefault(one.source, []).append(words)
        found[check] = "; ".join(f"{source}: {', '.join(words)}" for source, words in by_source.items())
    return found


def stated_inputs(result: Mapping[str, Any]) -> "dict[str, list[UsedInput]]":
    """Return check -> the inputs that its findings state, of an entry of results.json."""
    from checks.verdict import UsedInput

    found = {f["check"]: f["inputs"] for f in result["findings"] if f.get("inputs")}
    return {check: [UsedInput(**one) for one in inputs] for check, inputs in found.items()}


def input_words(check: str, used: "UsedInput") -> str:
    """Return an input in words: `added mass 7 kg`."""
    from checks.acceptance import CHECKS
    from specs.bench import channel_source
    from specs.units import DIMENSIONLESS

    if used.name.startswith(CHANNELS):
        return f"{used.name.removeprefix(CHANNELS)} {source_words(channel_source(used.value))}"
    declared = CHECKS[check].inputs.get(used.name) if check in CHECKS else None
    if declared is None or isinstance(used.value, str):
        return f"{used.name} = {_text(used.value)}"
    U = f" ± {used.U:.10g}" if used.U is not None else ""
    return f"{declared.label} {_text(used.value)}{U} {used.unit}".removesuffix(f" {DIMENSIONLESS}")


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_text, value))}]"
    return _named(value) if isinstance(value, str) else f"{value:.10g}"


def _named(text: str) -> str:
    """Return a name, cut where it would push what scales a value out of its line."""
    return text if len(text) <= _LONGEST_NAME else f"{text[:_LONGEST_NAME]}…"


def source_words(source: "ChannelSource") -> str:
    """Return how a channel is read from its source."""
    words = [f"is read from '{_named(source.name)}'"] if source.name else []
    words += [f"is multiplied by {source.gain:.10g}"] if source.gain != 1.0 else []
    words += [f"is taken in {_named(source.unit)}"] if source.unit else []
    words += [f"is sampled every {source.sampling_time_s:.10g} s"] if source.sampling_time_s is not None else []
    return " and ".join(words) or "is read as it is"
