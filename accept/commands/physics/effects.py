"""`accept model effects`: list the effects that can be named as missing, their signs, and the experiment for each."""

import textwrap

from accept.base.documents.listings import EffectList, EffectListed
from accept.commands.answer import Answer, File, command
from accept.commands.options import JsonAnswer
from checks.gap import EFFECTS

WIDTH, INDENT = 80, "    "


@command
def run(json: JsonAnswer = None) -> Answer:
    """List the effects that `accept gap` can name as missing. Where each shows, and the measurement that shows it
    alone."""
    listed = [
        EffectListed(
            effect.name, effect.title, tuple(p.name for p in effect.parameters), tuple(effect.channels), effect.sign,
            effect.experiment.value, tuple(effect.sources),
        )
        for effect in EFFECTS.values()
    ]  # fmt: skip
    lines = (line for name in EFFECTS for line in _lines(name))
    return Answer(File(json, EffectList(tuple(listed))), *lines)


def _lines(name: str) -> list[str]:
    effect = EFFECTS[name]
    parameters = ", ".join(p.name for p in effect.parameters)
    said = (
        f"shows on {', '.join(effect.channels)}: {effect.sign}",
        f"alone: {effect.experiment.value}",
        f"source: {', '.join(effect.sources)}",
    )
    wrapped = (textwrap.wrap(line, WIDTH, initial_indent=INDENT, subsequent_indent=2 * INDENT) for line in said)
    head = f"{effect.name}{f' ({parameters})' if parameters else ''}: {effect.title}"
    return [head, *(line for lines in wrapped for line in lines)]
