"""The response that `accept frf --json` wrote."""

import numpy as np

from checks.arrays import Array
from checks.errors import RecordError
from hw.records.responses.file import Curve, ResponseFile, response_file
from hw.records.source import Source
from specs.files import json_of


def read_json(source: Source) -> ResponseFile:
    """Return the response with its coherence and variance unchanged. `nu` are degrees of freedom, one fewer than
    averages. Raises RecordError if the file holds several, or is not of this program."""
    try:
        found = json_of(source.raw)["responses"]
    except (ValueError, KeyError, TypeError) as e:
        raise RecordError(f"{source.file}: is no JSON of `accept frf --json`") from e
    if len(found) != 1:
        raise RecordError(f"{source.file}: holds {len(found)} responses; write one at a time")
    (one,) = found
    per = one["units"].get(one["input"], "")

    def column(part: str, channel: str) -> Array:
        return np.array([np.nan if v is None else v for v in one[part][channel]], float)

    curves = [
        Curve(
            c,
            np.array(values["re"]) + 1j * np.array(values["im"]),
            one["units"].get(c, ""),
            per,
            (column("coherence", c), ""),
            (column("var", c), ""),
        )
        for c, values in one["H"].items()
    ]
    averages = float(np.min(one["nu"])) + 1.0
    said = [f"{', '.join(one['files'])}, {one['estimator']}"]
    return response_file(source, np.array(one["f_Hz"], float), curves, one["input"], said, averages)
