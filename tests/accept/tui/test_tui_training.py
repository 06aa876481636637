"""Training: a whole simulated unit on simulated instruments, by keys, to a verified certificate and what was hidden."""

import re

import pytest

from accept.base.home import home
from accept.pictures.labels import label_of
from accept.store import open_store
from accept.tui.widgets.fields import Field
from accept.workflow.training import hidden_words, open_training, training_request
from tests.accept.tui.tui_help import press, running, settled, sign_first, type_line, words
from tests.soak import SOAK

FILES = {
    "one_stack": "stroke_one_stack.mat",
    "two_stacks": "stroke_two_stacks.mat",
    "closed_circuit": "add_mass_closed_circuit.mat",
    "open_circuit": "add_mass_open_circuit.mat",
    "record": "hysteresis.mat",
    "with_resistor": "sweep_lf_with_R.mat",
    "without_resistor": "sweep_lf.mat",
    "x_bending": "bending_X_top.mat",
    "y_bending": "bending_Y_top.mat",
    "torsion_left": "torsion_left.mat",
    "torsion_top": "torsion_top.mat",
    "high": "frf_noise_hf.mat",
}
LOW = {"apa": "frf_sweep.mat", "strut": "frf_noise.mat"}
# A whole APA has its test in a terminal; what a model says of a strut has tests of its own.
SPECS = {"apa": "apa" if SOAK else "apa-basic", "strut": "strut-basic"}
SEEDS = {"apa": 3, "strut": 6}  # a dead stack; a payload that is too heavy


async def focused(pilot, field: Field) -> None:
    """The cursor in a field: asked for, it comes with a later message; a quicker key would meet the field before."""
    field.input.focus()
    await settled(pilot)
    assert pilot.app.focused is field.input


async def measure_everything(pilot, kind: str) -> None:
    """Every field of every step, read from its instrument or given its file. The cursor leads: to the first empty line,
    and in the list to the first step that is not complete."""
    files = FILES | {"low": LOW[kind]}
    for _ in pilot.app.session.steps:
        await press(pilot, "enter")
        screen = pilot.app.screen
        if any(screen._instrument(f.place) is None and not f.place.is_file for f in screen.query(Field)):
            await press(pilot, *(["f6"] if len(screen.step.check.forms) > 1 else []))
        for field in list(screen.query(Field)):
            if field.place.declared.name in files:
                await focused(pilot, field)
                await type_line(pilot, files[field.place.declared.name])
            elif not field.place.is_file and screen._instrument(field.place) is not None:
                await focused(pilot, field)
                await press(pilot, "f3")
        assert screen.complete, words(pilot, "#status")
        await press(pilot, "escape")


@pytest.mark.parametrize("kind", ["apa", "strut"])
@pytest.mark.slow
async def test_a_training_unit_is_measured_judged_signed_and_revealed(kind):
    seed = SEEDS[kind]
    opened = []

    def load():
        opened.append(open_training(SPECS[kind], seed))
        return opened[0]

    _, hidden = training_request(kind, "T", seed)
    async with running(load) as pilot:
        await press(pilot, "enter", "enter")
        for _ in range(4 if kind == "strut" else 0):
            await press(pilot, "enter")
        await measure_everything(pilot, kind)
        await press(pilot, "s")
        findings = {label_of(f.quantity): f.verdict for f in pilot.app.session.result.findings}
        await sign_first(pilot)
        assert type(pilot.app.screen).__name__ == "Help"
        assert hidden in pilot.app.screen._text
        await press(pilot, "escape")
        assert "✓ verified" in words(pilot, "#certificate")
    told = hidden.partition("had to show as ")[2].partition(".")[0]
    shown = re.findall(r"(.+?): ([a-z ]+)(?:, |$)", told)  # a label may hold a comma
    assert bool(shown) == ("Hidden" in hidden)
    for label, verdict in shown:
        assert findings[label] == verdict.replace(" ", "_")
    if not shown:
        assert set(findings.values()) == {"pass"}
    assert not (home() / "bench.key").exists()
    with open_store() as store:  # a training never leaves anything in the real bench's record
        assert store.head().seq == 0
    assert not (home() / "keys").exists()
    opened[0].close()


def test_the_hidden_fault_is_told_in_words():
    assert "Nothing" in hidden_words(None, "apa")
    assert "dead" not in hidden_words("dead_stack", "apa")
    assert "Stroke, three stacks: fail" in hidden_words("dead_stack", "apa")


def test_a_strut_on_a_wrong_payload_fails_until_the_gap_analysis_names_it():
    told = hidden_words("wrong_payload", "strut")
    assert "had to show as Axial resonance: fail. After the gap analysis: Axial resonance: no result." in told
    assert "After" not in hidden_words("wrong_payload", "apa")
