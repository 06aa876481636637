"""`accept hw commission`: the first run at a real instrument, through what its driver assumes."""

from contextlib import closing
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Annotated

from typer import Argument

from accept.base.console import operator_name, say
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.certificate import trust
from accept.commands.answer import Answer, Remark, command, refusal
from accept.commands.bench.hw import Bench, Measurer, ask_at_terminal, bench_path, value_words
from accept.commands.trust.bench_keys import passphrase_of
from hw.errors import InstrumentError
from hw.instruments import DRIVERS, Instrument, Trial, open_instrument
from specs.bench import load_bench

REPEATS = 0.01  # how far a value may differ from the first, relative: the probe or the capacitor is not touched


@dataclass(frozen=True)
class TrialResult:
    """The result of a trial: the request to the technician, the outcome, and whether it passed. how: "refused", "seen"
    (the value stayed and the technician saw the change), "absent" (this instrument cannot do it), "not seen", "passed
    over" (a value although the driver asks for this setting), "wrong", or "read" for a reading without a change."""

    trial: str
    found: str
    passed: bool
    how: str


@command
def commission(
    name: Annotated[str, Argument(help="The instrument's name in the bench file.")],
    bench: Bench = None,
    operator: Measurer = None,
) -> Answer:
    """Commission a real instrument. Asks for changes at its panel, writes a signed record beside the bench file."""
    file = load_bench(bench_path(bench))
    if name not in file.instruments or file.instruments[name].driver in trust.WITHOUT_WIRE:
        return refusal(f"{file.path} has no instrument {name!r} on a wire")
    entry = file.instruments[name]
    driver = DRIVERS.get(entry.driver)
    try:
        with closing(open_instrument(name, entry, ask_at_terminal)) as instrument:
            outcomes = _run_trials(instrument, driver.trials if driver else ())
            transcript = [] if instrument.link is None else [t.to_json() for t in instrument.link.take_transcript()]
    except InstrumentError as e:
        return refusal(e, Exit.INSTRUMENT)
    passed = bool(outcomes) and all(outcome.passed for outcome in outcomes)
    record = {
        "model": entry.model,
        "serial": entry.serial,
        "on": datetime.now(UTC).date().isoformat(),
        "operator": operator_name(operator),
        "passed": passed,
        "outcomes": [asdict(outcome) for outcome in outcomes],
        "transcript": transcript,
    }
    credential = _credential()
    place = trust.write_commissioning(file, name, record, credential)
    unsigned = "" if credential else "; unsigned, so it counts as unproven"
    words = f"{place}: {'passed' if passed else 'did not pass'}{unsigned}"
    return Answer(Remark(words), exit=Exit.ACCEPTED if passed else Exit.INSTRUMENT)


def _credential() -> trust.Credential | None:
    try:
        return trust.unlock(home(), trust.TECHNICIAN, passphrase_of(None, "Passphrase of the technician's key: "))
    except trust.KeysError as e:
        say(f"not signed: {e}")
        return None


def _run_trials(instrument: Instrument, trials: tuple[Trial, ...]) -> list[TrialResult]:
    """Return the first reading against the display, then every trial, each with the panel set back after it."""
    for reminder in instrument.reminders:
        say(reminder)
    ask_at_terminal("Connect what shall be measured and leave it untouched until the end, then Enter: ")
    first, outcome = _first(instrument)
    outcomes = [outcome]
    if first is None:
        return outcomes
    for trial in trials:
        instrument.connect()
        ask_at_terminal(f"{trial.do}, then Enter: ")
        outcomes.append(_run_trial(instrument, trial, first))
        say(f"  {outcomes[-1].found}{'' if outcomes[-1].passed else ' - NOT AS IT MUST BE'}")
        ask_at_terminal("Set it back as it was, then Enter: ")
        instrument.close()
    outcomes.append(_check_return(instrument, first))
    return outcomes


def _first(instrument: Instrument) -> tuple[float | None, TrialResult]:
    try:
        instrument.connect()
        reading = instrument.read()
    except InstrumentError as e:
        return None, TrialResult("a first reading", str(e), False, "read")
    shown = value_words(reading.value, reading.unit)
    answer = ask_at_terminal(f"The program read {shown}. Does the display show the same? yes or no: ")
    same = answer.strip().lower() == "yes"
    return reading.value, TrialResult("the display shows what was read", f"{shown}: {answer}", same, "read")


def _run_trial(instrument: Instrument, trial: Trial, first: float) -> TrialResult:
    """Return the result of a change at the panel: it must be refused, or leave the value and be seen by the
    technician."""
    try:
        instrument.confirm()
        value = instrument.read().value
    except InstrumentError as e:
        return TrialResult(trial.do, f"refused: {e}", True, "refused")
    if abs(value - first) > REPEATS * abs(first):
        return TrialResult(trial.do, f"{value:.6g}, not {first:.6g}", False, "wrong")
    absent = ", absent if this instrument cannot do it" if trial.optional else ""
    answer = ask_at_terminal(f"The value is the same. Did the display change? yes, no{absent}: ").strip().lower()
    if trial.optional and answer == "absent":
        return TrialResult(trial.do, "this instrument cannot do it", True, "absent")
    if answer != "yes":
        return TrialResult(trial.do, f"{value:.6g}, the same, and no change was seen: not done?", False, "not seen")
    if trial.asked:
        words = f"{value:.6g} was read although the display had changed: the instrument does not tell this setting"
        return TrialResult(trial.do, words, False, "passed over")
    return TrialResult(trial.do, f"{value:.6g}, the same; the display changed", True, "seen")


def _check_return(instrument: Instrument, first: float) -> TrialResult:
    try:
        instrument.connect()
        value = instrument.read().value
        instrument.confirm()
    except InstrumentError as e:
        return TrialResult("the value is back", str(e), False, "read")
    return TrialResult("the value is back", f"{value:.6g}", abs(value - first) <= REPEATS * abs(first), "read")
