"""A simulated unit as files, and the truth behind it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from accept.base.atomic_files import write_atomic
from accept.simulate import apa
from accept.simulate.faults import FAULTS, KINDS, UnitFault
from accept.simulate.records import MERGE_HZ, Columns, DrivenUnit, noise_record, slow_record, sweep_record
from accept.simulate.unit_request import FIGURES, UnitRequest, UnitRequestError
from accept.units import EXPERIMENTS, UNIT_FILE
from checks.gap import under_experiment
from hw.records import csv_bytes, mat_bytes
from specs.plugins import product_named

TRUTH_FILE = "truth.json"
SOUND = UnitFault("nothing is wrong", KINDS, ())
PARTS = {"joint_bottom": "FJ-bottom", "joint_top": "FJ-top", "encoder": "ENC-1"}
RESPONSES = {"low": "frf_noise", "high": "frf_noise_hf"}


@dataclass(frozen=True, eq=False)
class SimulatedUnit:
    """files: name -> content, `unit.toml` among them; truth: the values and effects that were put in."""

    serial: str
    files: Mapping[str, bytes]
    truth: Mapping[str, Any]


def simulate(request: UnitRequest) -> SimulatedUnit:
    """Return all files of a unit; equal requests give equal bytes on one machine. Raises UnitRequestError, and
    ModelError for an effect that the model does not have."""
    fault = _fault(request)
    model = request.affected()
    if fault.model is not None:
        model = model.with_values(fault.model(model.values))
    bench = DrivenUnit(request, model)
    if request.kind == "apa":
        figures = apa.draw(request.rng(FIGURES))
        figures = fault.figures(figures) if fault.figures else figures
        records = apa.records(bench, figures, fault.double)
        sections, own = apa.sections(figures), figures.truth()
        tables = {"flatness.csv": csv_bytes(apa.flatness_columns(figures))}
    else:
        records, tables, own = {"hysteresis": slow_record(bench, "hysteresis")}, {}, {}
        sections = {"hysteresis": {"record": "hysteresis.mat"}}
    responses, section = _responses(bench)
    sensor_F = 1e-6 * own["sensor_uF"] if "sensor_uF" in own else None
    more, listed, done = _experiments(bench, sensor_F)
    files = _files(request, records | responses | more, fault) | tables
    document = _document(request, {**sections, "frf": section} | ({EXPERIMENTS: listed} if listed else {}))
    files[UNIT_FILE] = tomlkit.dumps(document).encode()
    truth = _truth(request, bench, own) | ({EXPERIMENTS: done} if done else {})
    return SimulatedUnit(request.serial, files, truth)


def _fault(request: UnitRequest) -> UnitFault:
    if request.fault is None:
        return SOUND
    possible = [name for name, fault in FAULTS.items() if request.kind in fault.kinds]
    if request.fault not in possible:
        raise UnitRequestError(f"fault '{request.fault}': a unit of kind {request.kind} can have {', '.join(possible)}")
    return FAULTS[request.fault]


def _responses(bench: DrivenUnit) -> tuple[dict[str, Columns], dict[str, Any]]:
    """Return the records of frequency responses and their section of unit.toml."""
    request = bench.request
    names = RESPONSES | ({"low": "frf_sweep"} if request.kind == "apa" else {})
    if request.repeats and request.family == "strut":
        names |= {f"{key}_repeat": f"{stem}_2" for key, stem in RESPONSES.items()}
    records = {
        stem: sweep_record(bench, stem) if stem == "frf_sweep" else noise_record(bench, stem, key.startswith("high"))
        for key, stem in names.items()
    }
    section: dict[str, Any] = {key: f"{stem}.mat" for key, stem in names.items()}
    # The payload on the bench is the one that was weighed: a wrong payload is a fault, which the folder does not
    # mention.
    payload = request.model.values["bench.payload_kg"]
    return records, section | {"merge_Hz": MERGE_HZ, "payload_kg": payload}


def _experiments(bench: DrivenUnit, sensor_F: float | None) -> tuple[dict[str, Columns], list[Any], list[Any]]:
    """Return the records of the responses under every experiment, their entries of unit.toml, and the true values of
    the parameters that the experiments change. Each has its own noise."""
    request = bench.request
    records: dict[str, Columns] = {}
    listed: list[dict[str, Any]] = []
    done: list[dict[str, Any]] = []
    for number, asked in enumerate(request.experiments, 1):
        model = under_experiment(bench.model, asked.kind, asked.value, sensor_F)
        other = DrivenUnit(request, model)
        stems = {key: f"{stem}_x{number}" for key, stem in RESPONSES.items()}
        if request.repeats:
            stems |= {f"{key}_repeat": f"{stem}_2" for key, stem in stems.items()}
        level = asked.kind.drive_factor(asked.value)
        for key, stem in stems.items():
            records[stem] = noise_record(other, stem, key.startswith("high"), level)
        value = {} if asked.kind.value is None else {asked.kind.value.name: asked.value}
        listed.append({"kind": asked.kind.name} | value | {key: f"{stem}.mat" for key, stem in stems.items()})
        changed = {n: v for n, v in model.values.items() if v != bench.model.values.get(n)}
        done.append({"kind": asked.kind.name} | value | {"parameters": changed})
    return records, listed, done


def _files(request: UnitRequest, records: Mapping[str, Columns], fault: UnitFault) -> dict[str, bytes]:
    files = {}
    for stem, columns in records.items():
        content = mat_bytes(fault.spoil(stem, columns) if fault.spoil else columns, request.compact)
        files[f"{stem}.mat"] = content[: len(content) // 2] if stem in fault.cut else content
    return files


def _document(request: UnitRequest, sections: Mapping[str, Any]) -> dict[str, Any]:
    document: dict[str, Any] = {"serial": request.serial, "kind": request.kind, "simulated": True}
    parts = {"apa": f"APA-{request.serial}", **PARTS}
    if own := {name: part for name, part in parts.items() if name in product_named(request.kind).parts}:
        document["parts"] = own
    return document | dict(sections)


def _truth(request: UnitRequest, bench: DrivenUnit, figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return the true values, for comparison afterwards; no analysis reads them."""
    model = {name: value for name, value in bench.model.values.items() if abs(value) != float("inf")}
    return {
        "serial": request.serial,
        "kind": request.kind,
        "simulated": True,
        "model": request.model.name,
        "model_sha256": request.model.sha256,
        "seed": request.seed,
        "effects": [{"name": name, **parameters} for name, parameters in request.effects],
        "fault": request.fault,
        "hold": request.hold,
        "noise": dict(request.converters.noise),
        "parameters": model,
        **({"figures": dict(figures)} if figures else {}),
    }


def write(unit: SimulatedUnit, folder: Path) -> Path:
    """Write a unit folder with its truth beside. Raises OSError, and UnitRequestError for a folder that holds a
    unit that was not simulated: measured data are never replaced."""
    if (folder / UNIT_FILE).exists() and not (folder / TRUTH_FILE).exists():
        raise UnitRequestError(f"{folder}: holds a unit that was not simulated; choose another folder")
    truth = json.dumps(unit.truth, indent=1, allow_nan=False) + "\n"
    write_atomic(folder / TRUTH_FILE, truth.encode())
    for name, content in sorted(unit.files.items(), key=lambda item: item[0] == UNIT_FILE):
        write_atomic(folder / name, content, of_unit=True)
    return folder
