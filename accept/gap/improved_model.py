"""The improved model as a file: fitted values, the effects that were named, covariance, and their origin."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from accept.gap.unit_responses import Responses
from accept.models.model_file import OpenedModel, write_model
from checks.gap import EFFECTS, FittedElement, Result
from specs.model_sections import FitRecord

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
    record = FitRecord(
        names=list(fit.names),
        covariance=[[float(v) for v in row] for row in fit.cov],
        model=spec.name,
        model_sha256=given.model.sha256,
        serial=measured.serial,
        inputs=measured.inputs,
        G=dict(result.written_G),
    )
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
