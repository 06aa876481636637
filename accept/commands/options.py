"""Options that several commands share, each declared once: type, name and help. Light, so that help comes at once."""

import datetime
from pathlib import Path
from typing import Annotated

from typer import BadParameter, Option

from specs.plugins import products

Json = Annotated[Path | None, Option("--json", help="JSON file to write.")]
JsonAnswer = Annotated[
    Path | None, Option("--json", help="JSON file to write; -: stdout, in place of what a person reads.")
]
Csv = Annotated[Path | None, Option("--csv", help="CSV file to write.")]
Mat = Annotated[Path | None, Option("--mat", help="MATLAB file to write, with the fields of an frd object.")]
Uff = Annotated[Path | None, Option("--uff", help="Universal file (data set 58) to write.")]
Plot = Annotated[Path | None, Option("--plot", help="Picture to write: .pdf, .png or .svg.")]
SpecName = Annotated[str | None, Option("--spec", help="Built-in spec or TOML file; default: by the kind.")]
BenchPath = Annotated[Path | None, Option("--bench", help="bench.toml: judge with its calibrations.")]
ModelName = Annotated[str, Option("--model", help="Built-in model or TOML file.")]
StartModelName = Annotated[str | None, Option("--model", help="Model to start from; default: by the kind.")]
FirstDay = Annotated[
    datetime.datetime | None,
    Option("--since", formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="First day, UTC."),
]
LastDay = Annotated[
    datetime.datetime | None,
    Option("--until", formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="Last day, UTC."),
]
Operator = Annotated[
    str | None, Option(envvar="ACCEPT_OPERATOR", help="Name of the operator; default: the login name.")
]
QaPassphrase = Annotated[Path | None, Option(help="File with the passphrase of the QA key.")]
LargeRecords = Annotated[
    Path | None, Option("--records", help="Folder with the records that were too large to attach.")
]
ClusterAt = Annotated[str | None, Option("--cluster", help="Dask scheduler (tcp://HOST:8786), or local.")]
TimeStamping = Annotated[
    str | None, Option("--tsa", envvar="ACCEPT_TSA", help="URL of a time stamping authority (RFC 3161).")
]


def installed(kind: str | None) -> str | None:
    """Return the name of a product. Raises typer.BadParameter if it is not installed."""
    if kind is not None and kind not in products():
        raise BadParameter(f"no such product '{kind}' (installed: {', '.join(products())})")
    return kind
