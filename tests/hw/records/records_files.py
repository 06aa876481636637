"""Small record files of every format, written by libraries other than the reader under test."""

import io
import warnings
from pathlib import Path

import h5py
import numpy as np
import pyuff
from scipy.io import savemat

from checks.declare import Series

N = 64
DT = 1e-4
SERIES = Series("low", "Low record", {"t": "s", "Va": "V", "Vs": "V", "de": "m"}, optional_channels={"da": "m"})


def channels(n: int = N, start: float = 0.5) -> dict[str, np.ndarray]:
    """t, Va, Vs, de, da of a plausible record, seeded."""
    rng = np.random.default_rng(7)
    t = start + DT * np.arange(n)
    scale = {"Va": 0.5, "Vs": 3.0, "de": 1e-5, "da": 1e-5}
    return {"t": t, **{name: s * rng.standard_normal(n) for name, s in scale.items()}}


def mat5(data: dict[str, object], compressed: bool = False) -> bytes:
    out = io.BytesIO()
    savemat(out, data, do_compression=compressed, oned_as="column")
    return out.getvalue()


def mat73(data: dict[str, np.ndarray], chunks: tuple[int, ...] | None = None) -> bytes:
    """HDF5 as MATLAB writes it: a userblock of 512 bytes, arrays transposed, the class in an attribute."""
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512) as f:
        for name, values in data.items():
            packed = {"chunks": chunks, "compression": 3} if chunks else {}
            made = f.create_dataset(name, data=np.atleast_2d(values), **packed)
            made.attrs["MATLAB_class"] = np.bytes_("double")
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    return header.ljust(512, b"\0") + out.getvalue()[512:]


def csv(data: dict[str, np.ndarray]) -> bytes:
    out = io.StringIO()
    np.savetxt(out, np.column_stack(list(data.values())), delimiter=",", header=",".join(data), comments="")
    return out.getvalue().encode()


def uff(data: dict[str, np.ndarray], path: Path, **extra: object) -> bytes:
    """Time records by pyuff; "add", since its "overwrite" leaves only the end of a binary file."""
    path.unlink(missing_ok=True)
    t = data["t"]
    for i, (name, values) in enumerate((k, v) for k, v in data.items() if k != "t"):
        made = {"type": 58, "func_type": 1, "rsp_node": i + 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
                "rsp_ent_name": name, "x": t, "data": values, "abscissa_spacing": 1,
                "orddenom_spec_data_type": 0} | extra  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pyuff.UFF(str(path)).write_sets(made, "add")
    return path.read_bytes()


def every_format(folder: Path) -> dict[str, bytes]:
    """File name -> bytes of the same record in every format and packing that is read."""
    data = channels()
    return {
        "plain.mat": mat5(data),
        "packed.mat": mat5(data, compressed=True),
        "v73.mat": mat73(data),
        "v73-packed.mat": mat73(data, chunks=(1, 32)),
        "table.csv": csv(data),
        "text.uff": uff(data, folder / "made.uff"),
        "binary.uff": uff(data, folder / "made.uff", binary=1),
        "uneven.uff": uff(data, folder / "made.uff", binary=1, abscissa_spacing=0),
    }
