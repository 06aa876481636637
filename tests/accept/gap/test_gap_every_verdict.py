"""`accept gap` to its end: terminal, gap.json, gap.pdf, gap.html and model.toml of every verdict, with and without
experiments. The searches are real, with two effects in the library, on responses drawn in the frequency domain."""

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader
from typer.testing import CliRunner

from accept.cli.main import app
from accept.gap import analyse_unit
from accept.gap.analyse_unit import GapAnalysis
from accept.gap.text import HEADLINE
from accept.gap.unit_responses import Responses
from accept.models.model_file import open_model, open_model_file
from checks.fitting import Dataset
from checks.fitting.identifiability import TWO_SIDED
from checks.gap import EFFECTS, EXPERIMENT_KINDS, ConditionTrial, Inputs, run, under_experiment, with_effects
from checks.model import UnidentifiedElement
from tests.checks.gap.shared.experiment_cases import DAMPERS, SPRINGS, known
from tests.checks.gap.shared.gap_cases import CHANNELS, FS, recorded

BINS = 100
LIBRARY = {"sensor_highpass", "payload_mass"}
HIGHPASS, PAYLOAD = ("sensor_highpass", {"f_Hz": 20.0}), ("payload_mass", {"kg": 0.8})


def odd_mode(zero_Hz: float) -> Any:
    """A mode that all channels share as a factor: no effect of the library does that. The nearer its zeros lie to its
    poles, the less it moves."""
    of = {"channel": "Vs", "gain": 1.0, "poles": [[420.0, 0.01]], "zeros": [[zero_Hz, 0.01]]}
    return UnidentifiedElement.of_entry(of, "odd mode")


WEAK, STRONG = 423.0, 441.0
MASS, RESISTOR = ("added_mass", 1.0), ("other_resistor", 20_000.0)
ACCEPTED, INCOMPLETE = 0, 4
FILES = {"gap.json", "gap.pdf", "model.toml"}


@dataclass(frozen=True)
class Hidden:
    """What is in a unit beside its model, the experiment that was made, and what becomes of it."""

    verdict: str
    effects: tuple[tuple[str, Mapping[str, float]], ...] = ()
    odd_zero_Hz: float = 0.0
    experiment: tuple[str, float] | None = None
    named: tuple[str, ...] = ()

    def analysis(self) -> GapAnalysis:
        given = open_model_file("apa-2dof")
        given = replace(given, model=known(*SPRINGS, *DAMPERS))
        truth = with_effects(given.model.with_values({"constants.ga_N_per_V": -33.0}), self.effects)
        A, B = (self._recorded(recorded(truth, seed)) for seed in (1, 2))
        trials: tuple[ConditionTrial, ...] = ()
        if self.experiment is not None:
            name, value = self.experiment
            kind = EXPERIMENT_KINDS[name]
            both = [self._recorded(recorded(under_experiment(truth, kind, value), seed)) for seed in (3, 4)]
            trials = (ConditionTrial(name, kind, value, *both),)
        inputs = Inputs(given.model, A, B, FS, without=frozenset(EFFECTS) - LIBRARY, trials=trials)
        result = run(inputs, lambda _: None)
        measured = Responses("V-1", "apa", A, B, inputs.merge_Hz, inputs={"low.csv": "0" * 64})
        return GapAnalysis(result, measured, given, inputs)

    def _recorded(self, data: Dataset) -> Dataset:
        data = data.thinned(BINS)
        return (
            replace(data, H=data.H * odd_mode(self.odd_zero_Hz).factor(data.f)[:, None]) if self.odd_zero_Hz else data
        )


CASES = {
    "agrees": Hidden("no_missing_effect"),
    "agrees, experiment": Hidden("no_missing_effect", experiment=MASS),
    "explained": Hidden("explained", (HIGHPASS,), named=("sensor_highpass",)),
    "explained by its experiment": Hidden("explained", (PAYLOAD,), experiment=MASS, named=("payload_mass",)),
    "ambiguous": Hidden("ambiguous", (PAYLOAD,)),
    "ambiguous, experiment without an answer": Hidden("ambiguous", (PAYLOAD,), experiment=RESISTOR),
    "name beside a refused remainder": Hidden("partly_explained", (HIGHPASS,), WEAK, None, ("sensor_highpass",)),
    "name beside a refused remainder, experiment": Hidden(
        "partly_explained", (HIGHPASS,), WEAK, MASS, ("sensor_highpass",)
    ),
    "unexplained": Hidden("unexplained", (), STRONG),
    "unexplained, experiment": Hidden("unexplained", (), STRONG, MASS),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_every_verdict_is_reported_whole(case: Hidden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Red before for the names beside a refused remainder (exit 6: no parameter 'unnamed_mode_all.f_Hz') and for the
    one that its experiment shows (KeyError 'Vs@added_mass')."""
    done = case.analysis()
    assert (done.result.verdict, tuple(n.effect for n in done.result.named)) == (case.verdict, case.named)
    unit, out = tmp_path / "V-1", tmp_path / "out"
    unit.mkdir()
    (unit / "unit.toml").write_text('serial = "V-1"\nkind = "apa"\n[frf]\nlow = "low.csv"\n')
    monkeypatch.setattr(analyse_unit, "analyse", lambda *_: done)
    html = find_spec("plotly") is not None

    ran = CliRunner().invoke(app, ["gap", str(unit), "--out", str(out), *(["--html"] if html else [])])

    settled = case.verdict in ("no_missing_effect", "explained")
    assert ran.exit_code == (ACCEPTED if settled else INCOMPLETE), ran.output
    assert {p.name for p in out.iterdir()} == FILES | ({"gap.html"} if html else set())
    assert json.loads((out / "gap.json").read_bytes())["verdict"] == case.verdict
    assert open_model(out / "model.toml").frf(done.inputs.A.f[:3], channels=CHANNELS).all()
    page = " ".join(
        " ".join(p.extract_text() for p in PdfReader(io.BytesIO((out / "gap.pdf").read_bytes())).pages).split()
    )
    shown = [page, (out / "gap.html").read_text(encoding="utf-8") if html else page]
    assert HEADLINE[case.verdict] in ran.stdout
    for text in shown:
        assert HEADLINE[case.verdict] in text
        assert ("How well each named value is determined" in text) == bool(case.named)
    for name, it in done.identifiability.items():
        lo, hi = done.profile(name).ci95
        assert lo < done.result.fit.at[name] < hi
        # These values are determined well, so that the likelihood is a parabola about them: 10 % of its width.
        assert hi - lo == pytest.approx(2.0 * TWO_SIDED * it.sd, rel=0.1)
