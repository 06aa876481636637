"""The improved model as a file: fitted values, the effects that were named, covariance, and their origin.

`accept gap --empirical` adds an unidentified effect as an element that is labelled so, if the written file then
explains unseen records at least as well in every channel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from accept.gap.unit_responses import Responses
from accept.models.model_file import OpenedModel, fit_record, open_model, write_model
from checks.fitting import Dataset, gaps
from checks.gap import EFFECTS, FittedElement, Inputs, Result, fit_element
from checks.model import Model, UnidentifiedElement

PAYLOAD = "bench.payload_kg"


def write_improved(
    path: Path, given: OpenedModel, measured: Responses, result: Result, unidentified: Sequence[FittedElement] = ()
) -> None:
    """Write model.toml; unidentified: elements that are added without a name. Faults that were found before the search
    belong to the records, not to the model, and are left out; only a reversed sensor is an effect that a model can
    have."""
    fit, spec = result.fit, given.spec
    # The misalignment is an effect and a parameter by one name; as an effect it has no prior for later estimates of it.
    added = {f"{n.effect}.{k}" for n in result.named for k in n.parameters}
    own = [n for n in fit.names if n in given.model.values and n not in added]
    record = fit_record(fit, given, measured.serial, measured.inputs, G=dict(result.written_G))
    weighed = {n: given.model.values[n] for n in (PAYLOAD,) if n in given.model.values}  # as the unit's folder says
    values = weighed | {n: fit.at[n] for n in own} | dict(result.bench_latency)
    effects = [(n.effect, {k: v.value for k, v in n.parameters.items()}) for n in result.named if n.effect in EFFECTS]
    name = spec.name if spec.name.endswith(measured.serial) else f"{spec.name}-{measured.serial}"
    write_model(
        path,
        spec,
        values,
        {n: fit.sds[n] for n in own},
        effects=effects,
        unidentified=unidentified,
        elements=tuple(element_entries(result)),
        damping=result.damping,
        record=record,
        name=name,
    )


def element_entries(result: Result) -> Iterator[dict[str, Any]]:
    """Yield the entries of fitted elements in a model file, one for each direction of a place."""
    fit, of_name = result.fit, {e.name: e for e in result.after.response.effects}
    for found in (e for e in result.elements if e.fitted):
        of_head: dict[str, dict[str, str]] = {}
        for parameter in of_name[found.fitted].parameters:
            for target in parameter.sets:
                head, _, quantity = target.rpartition(".")
                of_head.setdefault(head, {})[quantity] = f"{found.fitted}.{parameter.name}"
        for head, quantities in of_head.items():
            _, place, direction = head.split(".")
            at = [fit.names.index(name) for name in quantities.values()]
            numbers = {q: {"value": fit.at[name], "sd": fit.sds[name]} for q, name in quantities.items()}
            covariance = fit.cov[np.ix_(at, at)].tolist()
            yield {"place": place, "direction": direction, "kind": found.kind, **numbers, "covariance": covariance}


AGREES = 1.0  # G of a channel up to which there is nothing to add


@dataclass(frozen=True, eq=False)
class AddedElement:
    """One channel: its element, or None with the reason; before, after: G on unseen records."""

    channel: str
    fitted: FittedElement | None
    before: float
    after: float
    reason: str = ""

    @property
    def document(self) -> dict[str, Any]:
        out: dict[str, Any] = {"channel": self.channel, "G_before": self.before, "G_after": self.after}
        if self.fitted is not None:
            one = self.fitted.element
            pairs = {"poles": [list(p) for p in one.poles], "zeros": [list(z) for z in one.zeros]}
            out |= {"gain": one.gain, **pairs, "covariance": self.fitted.covariance.tolist()}
        return out | {"added": self.fitted is not None, "reason": self.reason}


def write_with_elements(
    path: Path, given: OpenedModel, measured: Responses, result: Result, inputs: Inputs
) -> tuple[AddedElement, ...]:
    """Write the improved model, without unidentified elements, then with every one that helps, and return those."""
    write_improved(path, given, measured, result)
    model = open_model(path)
    A, B = (d.select(result.after.data.channels) for d in (inputs.A, inputs.B))
    if any(e.parameters or e.exchanges for e in result.early):
        reason = "the records themselves have faults, which no model holds"
        return tuple(AddedElement(c, None, G, G, reason) for c, G in _G(model, B).items())
    before, found = _G(model, B), {}
    for channel, G in before.items():
        if G > AGREES:
            M = [model.frf(d.f, channels=(channel,))[:, 0] for d in (A, B)]
            found[channel] = fit_element(channel, M[0], A, B, M[1])
    elements = {c: f for c, f in found.items() if f is not None}
    if elements:
        write_improved(path, given, measured, result, tuple(elements.values()))
    after = _G(open_model(path), B)
    worse = [c for c in after if after[c] > before[c]]
    if worse:  # one element acts on its channel alone, so each is judged by itself
        elements = {c: f for c, f in elements.items() if c not in worse}
        write_improved(path, given, measured, result, tuple(elements.values()))
        after = _G(open_model(path), B)
    return tuple(
        AddedElement(c, elements.get(c), before[c], after[c], _reason(c, before[c], found, worse)) for c in before
    )


def _reason(channel: str, before: float, found: dict[str, FittedElement | None], worse: list[str]) -> str:
    if before <= AGREES:
        return "agrees as it is"
    if found.get(channel) is None:
        return "no rational element explains more of unseen records than chance"
    return "an element would explain unseen records worse" if channel in worse else ""


def _G(model: Model, data: Dataset) -> dict[str, float]:
    H = model.frf(data.f, channels=data.channels)
    return {c: g.G for c, g in gaps([data.around(H)], [data.H - H]).items()}


def elements_of(added: Sequence[AddedElement]) -> dict[str, UnidentifiedElement]:
    """Return the added elements by channel."""
    return {a.channel: a.fitted.element for a in added if a.fitted is not None}
