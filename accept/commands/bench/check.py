"""`accept hw check`: an instrument against its reference."""

import json as jsonlib
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from typing import Annotated, Any

from typer import Argument, Option

from accept.base.console import say
from accept.base.exit_codes import Exit
from accept.capture.reference_check import CHECKED, ReferenceCheck, compared, history, keep
from accept.commands.answer import PLAIN, Answer, File, command, refusal, table
from accept.commands.bench.hw import Bench, Measurer, ask_at_terminal, bench_path
from accept.commands.options import Json
from accept.commands.trust.bench_keys import who_acts
from accept.store import open_store
from checks.rounding import rounded_U
from hw.errors import InstrumentError, SettingsError
from hw.instruments import open_instrument, scaled
from specs.bench import OFFLINE, InstrumentEntry, ReferenceEntry, load_bench
from specs.strict import SpecError
from specs.units import UnitMismatch, factor

SHOWN = 10  # comparisons of the past in the table
Evidence = dict[str, Any]


@command
def run(
    name: Annotated[str, Argument(help="The instrument's name in the bench file.")],
    bench: Bench = None,
    readings: Annotated[int, Option(min=1, max=100, help="Readings of the artefact.")] = 3,
    in_place: Annotated[bool, Option("--in-place", help="The artefact is in place: ask nothing.")] = False,
    json: Json = None,
    operator: Measurer = None,
) -> Answer:
    """Compare an instrument with its reference. Exit 3 if it is farther off than both uncertainties allow (E_n > 1)."""
    who = who_acts(operator)
    file = load_bench(bench_path(bench))
    entry = file.instruments.get(name)
    if entry is None:
        return refusal(f"{file.path} has no instrument {name!r} (it has: {', '.join(file.instruments)})")
    artefact = _artefact(file.path, name, entry)
    try:
        values, evidence = _values(name, entry, artefact, readings, in_place)
    except (SettingsError, UnitMismatch) as e:
        return refusal(f"{name}: {e}")
    except InstrumentError as e:
        return refusal(e, Exit.INSTRUMENT)
    check = compared(name, entry, artefact, values)
    with open_store() as store:
        keep(store, check, evidence, who)
        past = history(store.events(what=CHECKED), name, entry.serial)
    document = jsonlib.dumps(check.to_json() | {"history": [one.to_json() for one in past]}, allow_nan=False)
    shown = table(("when (UTC)", "artefact", "value", "read", "off by", "E_n", ""), map(_row, past[-SHOWN:]), **PLAIN)
    return Answer(shown, File(json, document.encode()), exit=Exit.ACCEPTED if check.passed else Exit.REJECTED)


def _artefact(path: str, name: str, entry: InstrumentEntry) -> ReferenceEntry:
    """Return the artefact of an instrument. Raises SpecError if the entry has none that a comparison can rest on."""
    key, artefact = f"instruments.{name}.reference", entry.reference
    if artefact is None:
        raise SpecError(path, [f"{key} is missing: what, value, unit, U, certificate"])
    if entry.accuracy is None:
        raise SpecError(path, [f"instruments.{name}.accuracy is missing: how far it may be off is unknown"])
    if artefact.due is not None and artefact.due < datetime.now(UTC).date():
        raise SpecError(path, [f"{key}.due = {artefact.due}: the certificate of the reference has expired"])
    return artefact


def _values(
    name: str, entry: InstrumentEntry, artefact: ReferenceEntry, count: int, in_place: bool
) -> tuple[list[float], Evidence]:
    """Return readings of the artefact in its unit, and the traffic. Raises InstrumentError, UnitMismatch."""
    if entry.driver == OFFLINE:
        ask = f"Put {artefact.what} on {name}; what does it show, in {artefact.unit}? "
        return [_number(ask_at_terminal(ask)) for _ in range(count)], {}
    with closing(open_instrument(name, entry, ask_at_terminal)) as instrument:
        to_unit = factor(instrument.unit, artefact.unit)

        def mean_of(place: Callable[[], object]) -> list[float]:
            place()
            return [scaled(instrument.read().value, to_unit) for _ in range(count)]

        for reminder in instrument.reminders:
            say(reminder)
        instrument.connect()
        if instrument.unit == "m":  # the zero of a length gauge is anywhere: a step is the difference of two heights
            low = mean_of(lambda: ask_at_terminal(f"Put the probe beside {artefact.what}, on its base, then Enter: "))
            high = mean_of(lambda: ask_at_terminal(f"Put the probe on {artefact.what}, then Enter: "))
            values = [above - sum(low) / len(low) for above in high]
        else:
            values = mean_of(
                lambda: None if in_place else ask_at_terminal(f"Connect {artefact.what} to {name}, then Enter: ")
            )
        instrument.confirm()
        traffic = [] if instrument.link is None else [t.to_json() for t in instrument.link.take_transcript()]
        return values, {"instrument": name, "settings": dict(instrument.asked), "transcript": traffic}


def _number(typed: str) -> float:
    try:
        return float(typed)
    except ValueError as e:
        raise SettingsError(f"{typed!r}: expected a number") from e


def _row(one: ReferenceCheck) -> tuple[str, ...]:
    off = f"{one.value - one.reference:+.3g} ± {rounded_U(one.U)} {one.unit}"
    artefact, value = f"{one.what} ({one.certificate})", f"{one.reference:g} {one.unit}"
    return one.time[:19], artefact, value, f"{one.value:.7g}", off, f"{one.E_n:+.2f}", "" if one.passed else "MISSED"
