"""Responses of a struct with the fields of MATLAB's frd object."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.responses.file import Curve, ResponseFile, response_file
from hw.records.responses.units import TAU, TIME_UNITS, converted, hertz
from hw.records.source import Source

DEFAULT_UNIT = "rad/TimeUnit"  # of an frd object without FrequencyUnit, as MATLAB takes it
NYQUIST = 1.0 + 1e-6  # half of the sampling frequency, with the digits of both

Fields = Mapping[str, NDArray[Any]]


def read_frd(source: Source, own: Fields, input: str) -> ResponseFile:
    """Return the responses to one input. ResponseData (C, M, F), or with one input or output without that side;
    frequencies, names, units, delays and sampling time as the fields state them. Raises RecordError."""
    file = source.file
    stated_unit = _text(own, "FrequencyUnit")[0] or _text(own, "Units")[0]  # its name before 2012
    time_unit = _text(own, "TimeUnit")[0]
    unit = stated_unit or DEFAULT_UNIT
    f = np.asarray(own["Frequency"], float).ravel() * hertz(file, "Frequency", unit, time_unit)
    shown = unit if "timeunit" not in unit.lower() else unit.replace("TimeUnit", time_unit or "second")
    said = [
        "the fields of an frd object",
        *([] if stated_unit else [f"no FrequencyUnit: {DEFAULT_UNIT}, as in MATLAB"]),
    ]
    said += converted("frequencies", shown)
    names = {side: _text(own, f"{side}Name") for side in ("Input", "Output")}
    H = _cube(file, own, f.size, names)
    outputs, inputs = H.shape[:2]
    if inputs > 1:
        known = [n for n in names["Input"] if n]
        if input not in known:
            way = (
                f" ({', '.join(known)}); name one of them with --input" if known else " without names; save one of them"
            )
            raise RecordError(f"{file}: has {inputs} inputs{way}")
        column = names["Input"].index(input)
    else:
        column = 0
    delay, words = _delays(file, own, f, H.shape, time_unit)
    H = (H * delay)[:, column]
    channels = [n or f"y{i + 1}" for i, n in enumerate(_as_many(names["Output"], outputs))]
    if len(names["Output"]) not in (outputs, 1) or len(channels) != outputs:
        raise RecordError(f"{file}: has {len(names['Output'])} names of outputs for {outputs} responses")
    units = _as_many(_text(own, "OutputUnit"), outputs)
    per = _as_many(_text(own, "InputUnit"), inputs)[column]

    def table(name: str) -> Array | None:
        given = own.get(name)
        if given is None or not np.size(given):
            return None
        if np.size(given) != outputs * f.size:
            raise RecordError(f"{file}: {name} has {np.size(given)} values for {outputs} x {f.size} of the response")
        return np.asarray(given, float).reshape(outputs, f.size)

    coherence, var = table("Coherence"), table("Variance")
    if var is None:
        var = _variance(file, own, (outputs, inputs, f.size), column)
    curves = [
        Curve(
            name,
            H[i],
            units[i],
            per,
            None if coherence is None else (coherence[i], ""),
            None if var is None else (var[i], ""),
        )
        for i, name in enumerate(channels)
    ]
    averages = own.get("Averages")
    stated = None if averages is None or not np.size(averages) else float(np.ravel(averages)[0])
    stated_input = _as_many(names["Input"], inputs)[column]
    return response_file(source, f, curves, input or stated_input, [*said, *words], stated)


def _variance(file: str, own: Fields, shape: tuple[int, int, int], column: int) -> Array | None:
    """Return the total variance (C, F) over one input from the covariance that an idfrd object states, or None."""
    covariance = np.asarray(own.get("CovarianceData", ()), float)
    if not covariance.size:
        return None
    if covariance.size != 4 * math.prod(shape):
        raise RecordError(
            f"{file}: CovarianceData has {covariance.size} values, expected 2 x 2 for each of the response"
        )
    total: Array = np.trace(covariance.reshape(*shape, 2, 2)[:, column], axis1=2, axis2=3)
    return total


def _cube(file: str, own: Fields, F: int, names: Mapping[str, list[str]]) -> NDArray[np.complex128]:
    """Return ResponseData as (C, M, F). Of two dimensions the names tell which side is missing: inputs if several have
    names. Raises RecordError if it fits neither."""
    H = np.asarray(own["ResponseData"])
    if H.dtype.kind != "c":
        raise RecordError(f"{file}: ResponseData is not complex, so it has no phase")
    if H.ndim == 3 and H.shape[2] == F:
        return H
    if H.size % F or F not in H.shape:
        raise RecordError(f"{file}: ResponseData is {' x '.join(map(str, H.shape))} for {F} frequencies")
    flat = H.reshape(-1, F) if H.shape[-1] == F else H.reshape(F, -1).T
    several = len(names["Input"]) > 1
    if several and len(names["Input"]) != len(flat):
        raise RecordError(f"{file}: has {len(names['Input'])} names of inputs for {len(flat)} responses")
    return flat[None, :, :] if several else flat[:, None, :]


def _delays(
    file: str, own: Fields, f: Array, shape: tuple[int, ...], time_unit: str
) -> tuple[NDArray[np.complex128], list[str]]:
    """Return the phase (C, M, F) of the delays beside the data, in units of time, or in samples if Ts is above zero.
    Raises RecordError above half of the sampling frequency."""
    seconds = TIME_UNITS.get((time_unit or "seconds").lower().removesuffix("s"), np.nan)
    step = _number(own, "Ts") * seconds
    if step > 0.0 and f.max() * 2.0 * step > NYQUIST:
        raise RecordError(
            f"{file}: Ts = {step:g} s, and its frequencies run to {f.max():.6g} Hz, above half of the sampling's; is "
            "the FrequencyUnit right?"
        )
    outputs, inputs = shape[:2]
    total = np.zeros((outputs, inputs))
    for name, size in (("IODelay", (outputs, inputs)), ("OutputDelay", (outputs, 1)), ("InputDelay", (1, inputs))):
        given = np.asarray(own.get(name, 0.0), float)
        if given.size not in (0, 1, size[0] * size[1]):
            raise RecordError(f"{file}: {name} has {given.size} values for {outputs} outputs and {inputs} inputs")
        if given.size:
            total = total + (given.ravel()[0] if given.size == 1 else given.reshape(size))
    if not total.any():
        return np.ones((1, 1, 1), complex), []
    tau = total * (step if step > 0.0 else seconds)
    if not np.isfinite(tau).all():
        raise RecordError(f"{file}: its delays are in '{time_unit}', which is not known here; save them in seconds")
    words = f"delays of {', '.join(f'{1e6 * x:.6g}' for x in np.unique(tau))} us applied to the phase"
    return np.exp(-1j * TAU * f * tau[:, :, None]), [words]


def _number(own: Fields, name: str) -> float:
    given = own.get(name)
    return 0.0 if given is None or not np.size(given) else float(np.real(np.ravel(given)[0]))


def _as_many(words: list[str], count: int) -> list[str]:
    return words if len(words) == count else (words + [""] * count)[:count]


def _text(own: Fields, name: str) -> list[str]:
    """Return the words of a field, [""] without any."""
    value = own.get(name)
    if value is None or not np.size(value) or value.dtype.kind != "U":
        return [""]
    return [str(v).strip() for v in np.ravel(value)]
