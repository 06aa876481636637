"""`accept model effects`: list the effects that can be named as missing, their signs, and the experiment that isolates
each."""

import textwrap

from accept.base.console import clear_errors, tell
from accept.base.documents.answers import check_answer, wants_text
from accept.base.documents.listings import EffectList, EffectListed
from accept.base.exit_codes import Exit
from accept.commands.options import JsonAnswer
from checks.gap import EFFECTS

WIDTH, INDENT = 80, "    "


@clear_errors
def run(json: JsonAnswer = None) -> Exit:
    """List the effects that `accept gap` can name as missing. Where each shows, and the measurement that shows it
    alone."""
    check_answer(json)
    listed = [
        EffectListed(
            effect.name, effect.title, tuple(p.name for p in effect.parameters), tuple(effect.channels), effect.sign,
            effect.experiment.value, tuple(effect.sources),
        )
        for effect in EFFECTS.values()
    ]  # fmt: skip
    if wants_text(json, EffectList(tuple(listed))):
        for name in EFFECTS:
            tell(*_lines(name))
    return Exit.ACCEPTED


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
