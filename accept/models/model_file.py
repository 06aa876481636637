"""Models as files: opened with their effects built in, written with fitted values."""

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit import TOMLDocument

from accept.base.atomic_files import write_atomic
from checks.errors import ModelError
from checks.fitting import Fit
from checks.gap import FittedElement, effect_named, with_effects
from checks.misalignment import with_payload
from checks.model import ELEMENT, ModalApa, Model, Superelement, UnidentifiedElement, build_model
from checks.quantity import COVERAGE_FACTOR
from hw.superelement import matrices_of
from specs.model import ModelSpec, load_model, parse_model
from specs.model_sections import ByChannel, FitRecord, LearnedBenchRecord, PopulationRecord
from specs.plugins import product_named
from specs.units import model_label

UNIDENTIFIED = UnidentifiedElement.NAME
Effects = Sequence[tuple[str, Mapping[str, float]]]
AS_BUILT = "strut-as-built"  # its modes are as uncertain as they are from unit to unit
# The model of simulated units, by product.
SIMULATED_MODEL = {"apa": "apa-frame", "strut": "strut", "strut-plates": "strut-plates"}
KEPT_MODELS = 8  # a batch needs one or two for every kind of unit
_NO_VALUES: Mapping[str, float] = {}


@dataclass(frozen=True)
class OpenedModel:
    """A model with its description. left_out: its effects that a frequency response does not show."""

    spec: ModelSpec
    model: Model
    left_out: tuple[str, ...] = ()


_OPENED: dict[tuple[str, str], OpenedModel] = {}


def default_model(kind: str) -> str:
    """Return the model by which units of a product are explained. Raises ModelError if it has none, ProductError."""
    model = product_named(kind).model
    if model is None:
        raise ModelError(f"product '{kind}' has no model of its own; name one with --model")
    return str(model)


def open_model(name: str | Path) -> Model:
    """Return model by built-in name or TOML file, its [[effects]] built in. Raises SpecError or ModelError."""
    return open_model_file(name).model


def open_model_file(name: str | Path) -> OpenedModel:
    """Return the model of a file with its description. A model without further files is built once for the same bytes:
    hashes, checks, the gap workflow and the next unit ask for it again."""
    spec = load_model(name)
    if spec.apa_file is not None:
        return model_of_spec(spec)
    key = (spec.name, spec.sha256)
    opened = _OPENED.pop(key, None) or model_of_spec(spec)
    while len(_OPENED) >= KEPT_MODELS:
        _OPENED.pop(next(iter(_OPENED)))
    _OPENED[key] = opened  # at the end: the one that was not asked for the longest goes first
    return opened


def model_of_spec(spec: ModelSpec, matrices: Callable[[ModelSpec], Superelement | None] = matrices_of) -> OpenedModel:
    """Return the model of a description. matrices: reads its superelement. Raises ModelError, also for a model learned
    from units that are not one batch."""
    if (batch := spec.population) is not None and not batch.holds_together:
        raise ModelError(
            f"{spec.name}: was learned from units that are no batch: {len(batch.units)} of "
            f"{len(batch.units) + len(batch.apart)} belong; nothing is named by it, and `accept model learn` says why"
        )
    effects = effects_of(spec)
    built_in = [each for each in effects if effect_named(each[0]).in_model]
    left_out = tuple(name for name, _ in effects if not effect_named(name).in_model)
    model = with_effects(build_model(spec, matrices(spec)), built_in)
    for one in elements_of(spec):  # channels are multiplied by elements without a name
        model = replace(model, values={**model.values, **one.values()})
    return OpenedModel(spec, model, left_out)


def as_weighed(given: OpenedModel, serial: str, payload_kg: float | None, U_kg: float | None = None) -> OpenedModel:
    """Return the model with the payload of the unit's folder, as sure as its U (k = 2) says; unchanged without one, and
    if it was fitted to this very unit."""
    fitted_to = given.spec.fit.serial if given.spec.fit else None
    sd_kg = None if U_kg is None else U_kg / COVERAGE_FACTOR
    return given if fitted_to == serial else replace(given, model=with_payload(given.model, payload_kg, sd_kg))


def effects_of(spec: ModelSpec) -> list[tuple[str, dict[str, float]]]:
    """Return the file's effects by name, in order, without unidentified elements (`elements_of`). Raises ModelError."""
    out = []
    for entry in (e for e in spec.effects if e.name != UNIDENTIFIED):
        for key, value in entry.parameters.items():
            if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
                raise ModelError(f"{spec.name}: effect '{entry.name}': {key} is {value!r}; expected a number")
        out.append((entry.name, {key: float(value) for key, value in entry.parameters.items()}))
    return out


def elements_of(spec: ModelSpec) -> list[UnidentifiedElement]:
    """Return the unidentified elements of the file, one for a channel. Raises ModelError."""
    found: dict[str, UnidentifiedElement] = {}
    for entry in (e for e in spec.effects if e.name == UNIDENTIFIED):
        one = UnidentifiedElement.of_entry(entry.parameters, f"{spec.name}: effect '{UNIDENTIFIED}'")
        if one.channel in found:
            raise ModelError(f"{spec.name}: effect '{UNIDENTIFIED}': {one.channel} has two; expected one for a channel")
        found[one.channel] = one
    return list(found.values())


def write_model(
    path: Path,
    spec: ModelSpec,
    values: Mapping[str, float],
    sds: Mapping[str, float] = _NO_VALUES,
    *,
    effects: Effects = (),
    unidentified: Sequence[FittedElement] = (),
    elements: Sequence[Mapping[str, Any]] = (),
    damping: str | None = None,
    record: FitRecord | None = None,
    population: PopulationRecord | None = None,
    bench: LearnedBenchRecord | None = None,
    name: str | None = None,
) -> ModelSpec:
    """Write the model file of `spec` with other values to path, and return the spec that is read from it.

    values, sds: by flat name, in the names' units; without an sd the file's stays. effects, elements: appended;
    unidentified: replaces that of its channel. damping: `full` or `modal`. record, population, bench: the sections
    [fit], [population] (which removes [fit]) and [learned_bench]. name, damping: None keeps the file's. Comments stay,
    a superelement's path is made relative to path. Raises SpecError, ModelError before it writes, and OSError."""
    document = tomlkit.parse(spec.text)
    if name is not None:
        document["name"] = name
    if damping is not None and damping != spec.damping:
        document["damping"] = damping
    for flat, value in values.items():
        _set(document, spec, flat, float(value), sds.get(flat, spec.sds.get(flat)))
    if spec.apa_file is not None:
        _section(document, ["apa"])["file"] = _relative_path(path.parent, spec.apa_file)
    for effect, parameters in effects:
        values_of = {key: float(value) for key, value in parameters.items()}
        _append(document, "effects", {"name": effect} | values_of)
    for each in unidentified:
        _put_element(document, each)
    for one in elements:
        _append(document, "elements", one)
    if record is not None:
        document["fit"] = _record_table(record)
    if population is not None:
        document.pop("fit", None)
        document["population"] = _record_table(population)
    if bench is not None:
        document.pop("learned_bench", None)
        table = tomlkit.table()
        table.update(bench.model_dump(exclude_none=True))
        document["learned_bench"] = table
    content = tomlkit.dumps(document).encode()
    read = parse_model(content, str(path), path.parent)
    write_atomic(path, content)
    return read


def fit_record(fit: Fit, base: OpenedModel, serial: str, inputs: dict[str, str], **more: Any) -> FitRecord:
    """Return where fitted values came from: with their covariance, the model before and the unit. more: its G."""
    covariance = [[float(v) for v in row] for row in fit.cov]
    return FitRecord(
        names=list(fit.names), covariance=covariance, model=base.spec.name, model_sha256=base.model.sha256,
        serial=serial, inputs=inputs, **more,
    )  # fmt: skip


def _set(document: TOMLDocument, spec: ModelSpec, flat: str, value: float, sd: float | None) -> None:
    """Write one number to the place of its flat name. A number in a list of three becomes `{ value, sd }`."""
    if flat not in spec.values and not math.isfinite(value):
        return  # an effect that is off: it is not in the file
    *sections, key = flat.split(".")
    quantity, channel, unit = [*key.split("_", 2), "", ""][:3]
    if channel in ByChannel.model_fields:
        sections, key = [*sections, f"{quantity}_{unit}"], channel
    table = _section(document, sections)
    number: Any = value
    if sd is not None:
        number = tomlkit.inline_table()
        number.update({"value": value, "sd": float(sd)})
    listed = _list_entry(table, key)
    if listed is not None:
        table[listed[0]][listed[1]] = number
        return
    note = table[key].trivia.comment if key in table else ""
    table[key] = number
    if flat.startswith(ELEMENT):
        table.pop("covariance", None)  # of the values before
    if note:
        table[key].comment(note.lstrip("# "))


def _list_entry(table: Any, key: str) -> tuple[str, int] | None:
    """Return list and index of a flat name: `com_x_mm` is number 0 of `com_mm`, if the file has such a list;
    `mode_stiffness_3` is number 2 of `mode_stiffness`, which is created and padded with ones if needed."""
    factors, _, number = key.rpartition("_")
    if factors in ("mode_stiffness", "mode_damping") and number.isdigit():
        if factors not in table:
            table[factors] = tomlkit.array()
        table[factors].extend([1.0] * (int(number) - len(table[factors])))
        return factors, int(number) - 1
    head, axis, unit = [*key.split("_", 2), "", ""][:3]
    whole = f"{head}_{unit}"
    return (whole, "xyz".index(axis)) if axis in ("x", "y", "z") and isinstance(table.get(whole), list) else None


def _section(document: TOMLDocument, names: Sequence[str]) -> Any:
    table: Any = document
    if names[:1] == [ELEMENT.rstrip(".")]:
        return next(e for e in document["elements"] if [e["place"], e["direction"]] == list(names[1:]))
    for name in names:
        if name not in table:
            table[name] = tomlkit.table()
        table = table[name]
    return table


def _record_table(record: FitRecord | PopulationRecord) -> Any:
    """Return the section of a record, a row of the covariance a line."""
    table = tomlkit.table()
    table.update(record.model_dump(exclude_none=True, exclude={"covariance"}))
    rows = tomlkit.array()
    rows.extend(record.covariance)
    table["covariance"] = rows.multiline(True)
    return table


def _put_element(document: TOMLDocument, fitted: FittedElement) -> None:
    """Put an unidentified element in the place of an earlier one on the same channel."""
    element = fitted.element
    kept = [e for e in document.get("effects", []) if (e["name"], e.get("channel")) != (UNIDENTIFIED, element.channel)]
    if "effects" in document:
        document["effects"] = tomlkit.aot()
        for entry in kept:
            document["effects"].append(entry)
    pairs = {"poles": [list(p) for p in element.poles], "zeros": [list(z) for z in element.zeros]}
    covariance = [[float(v) for v in row] for row in fitted.covariance]
    entry = {"channel": element.channel, "gain": element.gain, **pairs, "covariance": covariance}
    _append(document, "effects", {"name": UNIDENTIFIED} | entry)


def _append(document: TOMLDocument, key: str, values: Mapping[str, Any]) -> None:
    if key not in document:
        document[key] = tomlkit.aot()
    entry = tomlkit.table()
    for name, value in values.items():
        entry[name] = value
        if isinstance(value, dict):
            entry[name] = tomlkit.inline_table()
            entry[name].update(value)
    document[key].append(entry)


def with_moved_paths(text: bytes, old: Path, new: Path) -> bytes:
    """Return a model file for another folder: the paths in it are made relative to that folder."""
    document = tomlkit.parse(text.decode())
    file = document.get("apa", {}).get("file")
    if file is None:
        return text
    document["apa"]["file"] = _relative_path(new, old / file)
    return tomlkit.dumps(document).encode()


def _relative_path(folder: Path, file: Path) -> str:
    """Return the path of a file relative to a folder, absolute if it is on another drive."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:
        return file.resolve().as_posix()


def value_label(model: Model, name: str) -> str:
    """Return the label of a value, such as "APA: mode stiffness 3 (1243 Hz)", with the frequency of that free mode."""
    f_Hz = model.apa.frequencies_Hz.get(name) if isinstance(model.apa, ModalApa) else None
    return model_label(name) if f_Hz is None else f"{model_label(name)} ({f_Hz:.0f} Hz)"
