"""The seven APAs of [STB], as measured (tables 2.1 to 2.3 and 3.3), for the demo: values, no records."""

from dataclasses import dataclass
from pathlib import Path

import tomlkit

from accept.base.atomic_files import write_atomic
from accept.units import UNIT_FILE


@dataclass(frozen=True)
class SeedApa:
    """One APA of [STB]. heights_um: at the 8 points; published_flatness_um: table 2.1, as printed; k_N_per_um: table
    3.3, None if it was not measured (APA 3 had gone back to its maker)."""

    number: int
    heights_um: tuple[float, ...]
    published_flatness_um: float
    sensor_uF: float
    actuator_uF: float
    stroke_um: float
    k_N_per_um: float | None

    @property
    def serial(self) -> str:
        return f"APA-{self.number:02d}"


# The heights of APA 7 are those of its second measurement, the one that table 2.1 evaluates.
SEED_APAS = (
    SeedApa(1, (0, -0.5, 3.5, 3.5, 42, 45.5, 52.5, 46), 8.9, 5.10, 10.03, 373.2, 1.68),
    SeedApa(2, (0, -2.5, -3, 0, -1.5, 1, -2, -4), 3.1, 4.99, 9.85, 365.5, 1.69),
    SeedApa(3, (0, -1.5, 15, 17.5, 6.5, 6.5, 21, 23), 9.1, 1.72, 5.18, 181.7, None),
    SeedApa(4, (0, 6.5, 14.5, 9, 16, 22, 29.5, 21), 3.0, 4.94, 9.82, 359.7, 1.70),
    SeedApa(5, (0, -12.5, 16.5, 28.5, -43, -52, -22.5, -13.5), 1.9, 4.90, 9.66, 361.5, 1.70),
    SeedApa(6, (0, -8, -2, 5, -57.5, -62, -55.5, -52.5), 7.1, 4.99, 9.91, 363.9, 1.70),
    SeedApa(7, (0, 9, -18.5, -30, 31, 46.5, 16.5, 7.5), 18.7, 4.85, 9.85, 358.4, 1.93),
)


def unit_texts() -> dict[bytes, SeedApa]:
    """Return `unit.toml` of every APA -> the APA."""
    return {tomlkit.dumps(_document(apa)).encode(): apa for apa in SEED_APAS}


def write_units(folder: Path) -> list[Path]:
    """Write a unit folder per APA below `folder` and return them."""
    for text, apa in unit_texts().items():
        write_atomic(folder / apa.serial / UNIT_FILE, text, of_unit=True)
    return [folder / apa.serial for apa in SEED_APAS]


def _document(apa: SeedApa) -> dict[str, object]:
    document: dict[str, object] = {
        "serial": apa.serial,
        "kind": "apa",
        "flatness": {"z_um": list(apa.heights_um)},
        "capacitance": {"sensor_uF": apa.sensor_uF, "actuator_uF": apa.actuator_uF},
        "stroke": {"stroke_um": apa.stroke_um},
    }
    if apa.k_N_per_um is not None:
        document["stiffness"] = {"k_N_per_um": apa.k_N_per_um}
    return document
