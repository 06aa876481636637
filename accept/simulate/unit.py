"""A simulated unit as files, and the truth behind it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from accept.base.atomic_files import write_atomic
from accept.simulate import apa
from accept.simulate.faults import FAULTS, UnitFault
from accept.simulate.order import UnitRequest, UnitRequestError
from accept.simulate.records import MERGE_HZ, Columns, DrivenUnit, noise_record, slow_record, sweep_record
from accept.units.unit_experiments import EXPERIMENTS
from accept.units.unit_folder import KINDS, UNIT_FILE
from checks.gap.conditions.simulated import SENSOR_F, drive, under
from hw.records import csv_bytes, mat_bytes

TRUTH_FILE = "truth.json"
SOUND = UnitFault("nothing is wrong", KINDS, ())
PARTS = {"joint_bottom": "FJ-bottom", "joint_top": "FJ-top"}
RESPONSES = {"low": "frf_noise", "high": "frf_noise_hf"}


@dataclass(frozen=True, eq=False)
class SimulatedUnit:
    """files: name -> content, `unit.toml` among them; truth: what was put in."""

    serial: str
    files: Mapping[str, bytes]
    truth: Mapping[str, Any]


def simulate(order: UnitRequest) -> SimulatedUnit:
    """All files of a unit; equal orders give equal bytes on one machine. Raises OrderError, and ModelError for an
    effect that the model cannot hold."""
    fault = _fault(order)
    model = order.affected()
    if fault.model is not None:
        model = model.with_values(fault.model(model.values))
    bench = DrivenUnit(order, model)
    if order.kind == "apa":
        figures = apa.draw(order.rng("figures"))
        figures = fault.figures(figures) if fault.figures else figures
        records = apa.records(bench, figures, fault.double)
        sections, own = apa.sections(figures), figures.truth()
        tables = {"flatness.csv": csv_bytes(apa.flatness_columns(figures))}
    else:
        records, tables, own = {"hysteresis": slow_record(bench, "hysteresis")}, {}, {}
        sections = {"hysteresis": {"record": "hysteresis.mat"}}
    responses, section = _responses(bench)
    sensor_F = 1e-6 * own["sensor_uF"] if "sensor_uF" in own else SENSOR_F
    more, listed, done = _experiments(bench, sensor_F)
    files = _files(order, records | responses | more, fault) | tables
    document = _document(order, {**sections, "frf": section} | ({EXPERIMENTS: listed} if listed else {}))
    files[UNIT_FILE] = tomlkit.dumps(document).encode()
    truth = _truth(order, bench, own) | ({EXPERIMENTS: done} if done else {})
    return SimulatedUnit(order.serial, files, truth)


def _fault(order: UnitRequest) -> UnitFault:
    if order.fault is None:
        return SOUND
    possible = [name for name, fault in FAULTS.items() if order.kind in fault.kinds]
    if order.fault not in possible:
        raise UnitRequestError(f"fault '{order.fault}': a unit of kind {order.kind} can have {', '.join(possible)}")
    return FAULTS[order.fault]


def _responses(bench: DrivenUnit) -> tuple[dict[str, Columns], dict[str, Any]]:
    """Records of frequency responses and their section of unit.toml."""
    order = bench.order
    names = RESPONSES | ({"low": "frf_sweep"} if order.kind == "apa" else {})
    if order.repeats and order.kind == "strut":
        names |= {f"{key}_repeat": f"{stem}_2" for key, stem in RESPONSES.items()}
    records = {
        stem: sweep_record(bench, stem) if stem == "frf_sweep" else noise_record(bench, stem, key.startswith("high"))
        for key, stem in names.items()
    }
    section: dict[str, Any] = {key: f"{stem}.mat" for key, stem in names.items()}
    # What is on the bench is what was weighed: a payload that is wrong is a fault, and nobody says so.
    payload = order.model.values["bench.payload_kg"]
    return records, section | {"merge_Hz": MERGE_HZ, "payload_kg": payload}


def _experiments(bench: DrivenUnit, sensor_F: float) -> tuple[dict[str, Columns], list[Any], list[Any]]:
    """Records of the responses under every experiment, their entries of unit.toml, and the parameters that it changed
    with their true values. The noise of each is its own."""
    order = bench.order
    records: dict[str, Columns] = {}
    listed: list[dict[str, Any]] = []
    done: list[dict[str, Any]] = []
    for number, asked in enumerate(order.experiments, 1):
        model = under(bench.model, asked.kind, asked.value, sensor_F)
        other = DrivenUnit(order, model)
        stems = {key: f"{stem}_x{number}" for key, stem in RESPONSES.items()}
        if order.repeats:
            stems |= {f"{key}_repeat": f"{stem}_2" for key, stem in stems.items()}
        level = drive(asked.kind, asked.value)
        for key, stem in stems.items():
            records[stem] = noise_record(other, stem, key.startswith("high"), level)
        value = {} if asked.kind.value is None else {asked.kind.value.name: asked.value}
        listed.append({"kind": asked.kind.name} | value | {key: f"{stem}.mat" for key, stem in stems.items()})
        changed = {n: v for n, v in model.values.items() if v != bench.model.values[n]}
        done.append({"kind": asked.kind.name} | value | {"parameters": changed})
    return records, listed, done


def _files(order: UnitRequest, records: Mapping[str, Columns], fault: UnitFault) -> dict[str, bytes]:
    files = {}
    for stem, columns in records.items():
        content = mat_bytes(fault.spoil(stem, columns) if fault.spoil else columns, order.compact)
        files[f"{stem}.mat"] = content[: len(content) // 2] if stem in fault.cut else content
    return files


def _document(order: UnitRequest, sections: Mapping[str, Any]) -> dict[str, Any]:
    document: dict[str, Any] = {"serial": order.serial, "kind": order.kind}
    if order.kind == "strut":
        document["parts"] = {"apa": f"APA-{order.serial}", **PARTS, "encoder": "ENC-1"}
    return document | dict(sections)


def _truth(order: UnitRequest, bench: DrivenUnit, figures: Mapping[str, Any]) -> dict[str, Any]:
    """What was put in, for whoever wants to know afterwards; nothing here is read by the bench."""
    model = {name: value for name, value in bench.model.values.items() if abs(value) != float("inf")}
    return {
        "serial": order.serial,
        "kind": order.kind,
        "simulated": True,
        "model": order.model.name,
        "model_sha256": order.model.sha256,
        "seed": order.seed,
        "effects": [{"name": name, **parameters} for name, parameters in order.effects],
        "fault": order.fault,
        "hold": order.hold,
        "noise": dict(order.converters.noise),
        "parameters": model,
        **({"figures": dict(figures)} if figures else {}),
    }


def write(unit: SimulatedUnit, folder: Path) -> Path:
    """Write a unit folder with its truth beside. Raises OSError, and OrderError for a folder that holds a unit that
    was not simulated: measured data are never replaced."""
    if (folder / UNIT_FILE).exists() and not (folder / TRUTH_FILE).exists():
        raise UnitRequestError(f"{folder}: holds a unit that was not simulated; choose another folder")
    truth = json.dumps(unit.truth, indent=1, allow_nan=False) + "\n"
    write_atomic(folder / TRUTH_FILE, truth.encode())
    for name, content in sorted(unit.files.items(), key=lambda item: item[0] == UNIT_FILE):
        write_atomic(folder / name, content)
    return folder
