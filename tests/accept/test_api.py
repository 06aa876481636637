"""`import accept`: light, documented, and enough for the tutorial notebook, which is run here."""

import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import accept
from accept.pictures.formats import PictureError
from accept.pictures.interactive import page
from checks.picture import Line, Panel
from tests.accept.units.modelled_records import write_answers
from tests.checks.gap.shared.gap_units import make_strut
from tests.soak import SOAK

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorial" / "tutorial.ipynb"


def cells() -> list[dict]:
    return [c for c in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]


def test_the_import_is_light():
    code = "import sys, accept; print([m for m in ('numpy', 'scipy', 'typer', 'textual') if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert said.stdout.strip() == "[]"


def test_every_name_is_there_typed_and_documented():
    for name in accept.__all__:
        found = getattr(accept, name)
        assert inspect.getdoc(found), name
        if inspect.isfunction(found):
            assert "return" in inspect.signature(found).parameters or found.__annotations__["return"], name
    assert set(accept.__all__) <= set(dir(accept))
    with pytest.raises(AttributeError, match="it offers AcceptError, NoResult, Plot, analyse_gap"):
        accept.no_such_name  # noqa: B018


def test_the_page_of_the_interface_names_every_function():
    text = (NOTEBOOK.parents[1] / "reference" / "api.md").read_text(encoding="utf-8")
    missing = [name for name in accept.__all__ if f"accept.analysis.api.{name}" not in text]
    assert not missing


def test_the_tutorial_runs_and_says_what_was_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Every cell in order; those that compute a table or search for minutes only in the heavy lane."""
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    for cell in cells():
        if SOAK or "slow" not in cell["metadata"].get("tags", []):
            exec(compile("".join(cell["source"]), str(NOTEBOOK), "exec"), names)  # the project's own file
    assert names["result"].verdict == "accepted"
    assert 70 < names["response"].resonances["de"].f_Hz < 110
    assert accept.plot(names["response"])._repr_png_().startswith(b"\x89PNG")
    if SOAK:
        assert abs(names["off"].dy.value + 120) <= names["off"].dy.U
        assert [n.effect for n in names["found"].result.named] == ["misalignment"]


def test_a_picture_to_zoom_in_holds_its_curves_and_escapes_its_words(tmp_path: Path):
    pytest.importorskip("plotly")
    f = np.geomspace(1.0, 100.0, 7)
    size = Panel("de / Va", "frequency [Hz]", "<b>", (Line(f, 1 / f, "measured"),), True, True)
    phase = Panel("de / Va", "frequency [Hz]", "phase [deg]", (Line(f, -f, "measured"),), True)
    text = (
        accept.Plot({"de magnitude": size, "de phase": phase}, "<script>S</script>")
        .save(tmp_path / "a.html")
        .read_text()
    )
    assert "<script>S" not in text
    assert text.count('class="plotly-graph-div"') == 1  # the phase shares the axis of its magnitude
    with pytest.raises(PictureError, match="nothing to draw"):
        page({}, "empty")


def test_an_estimate_starts_no_process_which_would_run_the_callers_script_again(monkeypatch: pytest.MonkeyPatch):
    from accept.analysis import misalignment
    from checks.cause import Cause, NoResult, because

    def failing(*_: object) -> None:
        raise NoResult(because(Cause.SEARCH_FAILED, record="low", model="strut"))

    asked: list[int | None] = []

    def table(*_: object, workers: int | None = None) -> None:
        asked.append(workers)

    monkeypatch.setattr(misalignment, "table_for", table)
    measured = SimpleNamespace(serial="S-1", payload_kg=None, first=None, second=None, remarks=())
    monkeypatch.setattr(misalignment, "_responses_of", lambda _: measured)
    monkeypatch.setattr(misalignment, "estimate_misalignment", failing)
    with pytest.raises(NoResult):
        misalignment.estimate_unit(None, "strut-as-built")
    assert asked == [1]


def test_what_is_returned_says_in_short_what_it_holds(tmp_path: Path):
    """A judged strut printed half a million characters into a notebook."""
    unit = accept.read_unit(make_strut(tmp_path / "T-1", "T-1", seed=3))
    result, measured = accept.judge(unit, "strut-basic"), accept.responses(unit)
    lines = repr(result).splitlines()
    assert lines[0] == "T-1 (strut): accepted by spec strut-basic"
    assert len(lines) == 1 + len(result.findings)
    assert any(line.startswith("  axial_resonance_Hz 8") and line.endswith(": pass") for line in lines)
    response = accept.frequency_response(tmp_path / "T-1" / "frf_noise.mat", f_lo=10, f_hi=400)
    shown = [unit, measured, measured.first, response, response.records[0], accept.open_model(), accept.plot(response)]
    for found in shown:
        assert len(repr(found)) < 300, type(found)
        assert "array(" not in repr(found), type(found)
    assert repr(unit).startswith("LoadedUnit(T-1, strut, in ")
    assert "resonances: Vs 8" in repr(response)


def test_what_cannot_be_is_refused_by_one_kind_of_error(tmp_path: Path):
    (tmp_path / "unit.toml").write_text('serial = "S-1"\nkind = "strut"\n')
    wrong = [
        (lambda: accept.read_unit(tmp_path / "nowhere"), "nowhere"),
        (lambda: accept.open_model("stru"), "no such model"),
        (lambda: accept.simulate_unit(tmp_path / "U", kind="strutt"), "kind = 'strutt': expected one of"),
        (lambda: accept.plot(accept.to_ss), "function has no picture"),
        (lambda: accept.frequency_response(estimator="h2"), "estimator = 'h2': expected one of auto, h1, lpm"),
        (lambda: accept.fit_model(str(tmp_path / "nowhere")), "nowhere"),
        (
            lambda: accept.open_model("strut").frf([95.0], channels=["encoder"]),
            "no channel 'encoder' (it has Vs, de, da)",
        ),
        (lambda: accept.analyse_gap(tmp_path, without=["encoder_lowpas"]), "unknown effect 'encoder_lowpas' (known: "),
        (lambda: accept.simulate_unit(tmp_path), f"{tmp_path}: is there already"),
    ]
    for order, words in wrong:
        with pytest.raises(accept.AcceptError, match=re.escape(words)):
            order()
    assert not (tmp_path / "U").exists()


def test_a_wrong_kind_of_argument_is_named_with_what_is_expected(tmp_path: Path):
    response = {"f_lo": "low"}
    for call, words in (
        (lambda: accept.open_model(5), "open_model: name = 5: expected a text or a Path"),
        (lambda: accept.read_record("a.mat", 3), "read_record: input = 3: expected a text"),
        (lambda: accept.frequency_response("a.mat", **response), "f_lo = 'low': expected a number"),
        (lambda: accept.frequency_response("a.mat", f_hi=float("nan")), "f_hi = nan: expected a number or None"),
        (lambda: accept.read_record("a.mat", channels=["de"]), "channels = ['de']: expected a mapping or None"),
        (lambda: accept.fit_model("unit", starts=2.5), "starts = 2.5: expected a whole number"),
        (lambda: accept.judge("unit", 5), "judge: spec = 5: expected a text or None"),
        (lambda: accept.simulate_unit(tmp_path / "U", seed="x"), "seed = 'x': expected a whole number"),
        (lambda: accept.hammer_response("a.mat", block_s=True), "block_s = True: expected a number"),
        (lambda: accept.to_ss(5), "open_model: name = 5"),
        (lambda: accept.fit_model([1, 2]), "a unit is its folder"),
        (lambda: accept.plot([1, 2]), "list has no picture"),
        (lambda: accept.plot({"a": 1}), "dict has no picture"),
    ):
        with pytest.raises(accept.AcceptError) as e:
            call()
        assert words in str(e.value)


def test_help_teaches_what_goes_in_and_what_comes_out():
    for name in accept.__all__:
        found = getattr(accept, name)
        parameters = inspect.signature(found).parameters if inspect.isfunction(found) else {}
        if len(parameters) < 1 or name in ("dataset", "to_control", "save_ss"):
            continue
        text = inspect.getdoc(found)
        assert "\nArgs:\n" in text, name
        assert "\nReturns:\n" in text, name
        assert re.findall(r"^    (\w+): ", text.partition("Returns:")[0], re.M) == list(parameters), name


def test_pictures_of_what_the_page_shows_and_axes_of_ones_own():
    from matplotlib.figure import Figure

    model = accept.open_model("strut-2dof")
    f = np.geomspace(15.0, 600.0, 80)
    H = model.frf(f)
    data = accept.dataset(f, H, ("Vs", "de", "da"), (0.005 * np.abs(H)) ** 2)
    fitted = accept.fit_model(data, "strut-2dof", starts=1)
    for found in (model, data, fitted, fitted.fit, accept.to_ss(model)):
        drawn = accept.plot(found)
        assert {"de magnitude", "de phase"} <= set(drawn.panels), type(found)
        assert len(repr(found)) < 400, type(found)
    figure = Figure()
    axes = figure.subplots(2)
    accept.plot(data, ax=axes, panels=["de magnitude", "de phase"])
    assert axes[0].get_ylabel().startswith("magnitude")
    assert axes[1].get_ylabel().startswith("phase")
    assert len(axes[0].lines) >= 1
    assert len(accept.plot(data).figure.axes) == 6
    with pytest.raises(PictureError, match="no panel 'dz'"):
        accept.plot(data, panels=["dz"])
    with pytest.raises(PictureError, match="expected axes of matplotlib"):
        accept.plot(data, ax=5)


def test_the_module_lists_its_names_alone():
    assert [n for n in dir(accept) if not n.startswith("__")] == sorted(accept.__all__)


def test_the_page_leads_from_a_record_through_h1_to_a_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The page's own lines; the payload is told by the mass line, so it must come out within its U of the truth."""
    text = (NOTEBOOK.parents[1] / "reference" / "api.md").read_text(encoding="utf-8")
    (block,) = (b for b in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S) if "accept.fit_model(response" in b)
    changes = {"constants.ga_N_per_V": -30.5, "bench.payload_kg": 5.65}
    write_answers(tmp_path, ("low",), accept.open_model("apa-2dof"), changes, seed=6, noise=1e-4)
    monkeypatch.chdir(tmp_path)
    names: dict = {"accept": accept}
    exec(compile(block, "api.md", "exec"), names)  # the project's own page
    fit = names["fitted"].fit
    for name, true in changes.items():
        assert abs(fit.at[name] - true) < 2 * fit.sds[name], name
    assert fit.sds["constants.ga_N_per_V"] < 1.0  # told by the record: the prior has 3 N/V
