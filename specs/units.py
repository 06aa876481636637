"""The unit of a quantity is the suffix of its name; without a suffix it is SI or dimensionless."""

# Longest suffix first: `k_N_per_um` ends in `_um` too.
_SUFFIXES = {
    "N_s_per_m": "N s/m",
    "Nm_s_per_rad": "N m s/rad",
    "Nm_per_rad": "N m/rad",
    "N_per_um": "N/um",
    "um_per_V": "um/V",
    "N_per_V": "N/V",
    "V_per_m": "V/m",
    "V_per_N": "V/N",
    "kg_m2": "kg m2",
    "V_per_V": "V/V",
    "percent": "percent",
    "samples": "samples",
    "urad": "urad",
    "ohm": "ohm",
    "deg": "deg",
    "um": "um",
    "mm": "mm",
    "uF": "uF",
    "Hz": "Hz",
    "kg": "kg",
    "us": "us",
    "dB": "dB",
    "V": "V",
    "s": "s",
}
DIMENSIONLESS = "1"


def unit_of(quantity: str) -> str:
    """Unit of a quantity by its name: `k_closed_N_per_um` is in "N/um", `coherence` in "1"."""
    for suffix, unit in _SUFFIXES.items():
        if quantity == suffix or quantity.endswith("_" + suffix):
            return unit
    return DIMENSIONLESS


def without_unit(quantity: str) -> str:
    """The name without its unit: `k_closed` of `k_closed_N_per_um`; a name that is a unit alone stays."""
    for suffix in _SUFFIXES:
        if quantity.endswith("_" + suffix):
            return quantity.removesuffix("_" + suffix)
    return quantity
