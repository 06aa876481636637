"""Whatever a function of `import accept` is given, it answers or refuses in words: no other error, no warning."""

import inspect
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import accept

FUNCTIONS = [name for name in accept.__all__ if inspect.isfunction(getattr(accept, name))]
UNUSABLE: list[Any] = [
    None, 5, -1.0, float("nan"), float("inf"), True, "", "no such thing", b"bytes", [], [1, 2], {}, {"a": 1}, (),
    object(), np.array([]), np.array([np.nan]), np.zeros((2, 3)), np.array(["a"]), Path("no/such/place"), lambda: None,
]  # fmt: skip
SOUND: dict[str, Any] = {  # of the parameters that must be given, so that each of the others is asked for itself
    "f": np.arange(1.0, 9.0),
    "H": np.ones((8, 1), complex),
    "channels": ["de"],
    "var": np.ones((8, 1)),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_cannot_be_used_is_refused_in_words(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    function = getattr(accept, name)
    parameters = list(inspect.signature(function).parameters.values())
    for at in range(len(parameters)):
        for value in UNUSABLE:
            called = _call(function, parameters, at, value)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                with suppress(accept.AcceptError):
                    called()


def _call(function: Any, parameters: list[inspect.Parameter], at: int, value: Any) -> Any:
    """Return a call with one argument that may be unusable, and sound ones for the others that must be given."""
    given, keywords = [], {}
    for k, p in enumerate(parameters):
        if p.kind is p.VAR_KEYWORD:
            continue
        if k == at:
            it = value
        elif p.default is p.empty and p.kind is not p.VAR_POSITIONAL:
            it = SOUND.get(p.name, "no such thing")
        elif p.kind is p.VAR_POSITIONAL:
            it = "no such thing"
        else:
            continue
        if p.kind is p.KEYWORD_ONLY or (p.default is not p.empty and k == at):
            keywords[p.name] = it
        else:
            given.append(it)
    return lambda: function(*given, **keywords)


def test_so_is_what_goes_with_objects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Red before: panels, numbers of a simulated model, files of pictures, and every `say=` of analyse_gap."""
    monkeypatch.chdir(tmp_path)
    model = accept.open_model("apa-2dof")
    f = np.geomspace(15.0, 600.0, 40)
    H = model.frf(f)
    data, system = accept.dataset(f, H, model.channels, (0.005 * np.abs(H)) ** 2), accept.to_ss(model)
    calls = {
        "fit": lambda v: accept.fit_model(data, "apa-2dof", starts=v),
        "band": lambda v: accept.fit_model(data, "apa-2dof", f_lo=v),
        "axes": lambda v: accept.plot(model, ax=v or 5),
        "panels": lambda v: accept.plot(model, panels=v or 5),
        "picture": lambda v: accept.plot(model).save(v),
        "order": lambda v: accept.to_control(system, pade=v or "one"),
        "matrices": lambda v: accept.save_ss(system, v),
        "values": lambda v: accept.simulate_unit(tmp_path / "X", "apa", values={"bench.payload_kg": v}),
        "averages": lambda v: accept.dataset(f, H, model.channels, np.abs(H) ** 2, averages=v),
    }
    for name, call in calls.items():
        for value in (None, "", [], {"a": 1}, object(), np.array([np.nan]), lambda: None):
            with pytest.raises(accept.AcceptError) as refused:
                call(value)
            assert str(refused.value), (name, value)
