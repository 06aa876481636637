"""Arrays of MATLAB files with their shapes, complex ones and text too, as `outer.inner`."""

import io
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from checks.errors import RecordError
from hw.records.limits import DEFAULT_LIMITS
from hw.records.mat5 import vet_unpacked
from hw.records.source import SIGNATURE, Source

_DEEPEST = 8  # structures within structures


def arrays_of(source: Source) -> dict[str, NDArray[Any]]:
    """Return the arrays of a MATLAB file; cells of text become arrays of text. Raises RecordError."""
    raw = source.raw
    if raw.startswith(SIGNATURE) or raw.startswith(SIGNATURE, 512):
        return dict(_hdf5(source))
    if len(raw) < 128 or raw[124:128] not in (b"\x00\x01IM", b"\x01\x00MI"):
        raise RecordError(
            f"{source.file}: is none of a universal file, MATLAB 5 to 7.3 (.mat), a table (.csv, .txt), JSON; it "
            f"starts with {ascii(raw[:20])[1:]}"
        )
    from scipy.io import loadmat  # loads slowly: only when wanted

    vet_unpacked(source.file, raw, 16 * DEFAULT_LIMITS.max_samples)
    try:
        found = loadmat(io.BytesIO(raw))
    except Exception as e:  # of a damaged file also NameError
        raise RecordError(f"{source.file}: is damaged or cut: its variables cannot be read; copy it again") from e
    return dict(_flatten("", {k: v for k, v in found.items() if not k.startswith("__")}))


def _flatten(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, NDArray[Any]]]:
    if depth > _DEEPEST:
        return
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _flatten(f"{name}.{key}" if name else str(key), part, depth + 1)
    elif isinstance(value, np.ndarray | np.void) and value.dtype.names:
        for i, part in enumerate(np.ravel(value)):
            own = name if np.size(value) == 1 else f"{name}({i + 1})"
            yield from _flatten(own, {key: part[key] for key in value.dtype.names}, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        cells = list(value.ravel())
        words = [_word(cell) for cell in cells]
        if all(word is not None for word in words):
            yield name, np.array(words, dtype=str)
        else:
            for i, cell in enumerate(cells):
                yield from _flatten(f"{name}({i + 1})", cell, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiucUb":
        yield name, value


def _word(cell: Any) -> str | None:
    """Return the text of a cell, also of an empty one; None for other content."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, np.ndarray) and cell.size == 0:
        return ""
    if isinstance(cell, np.ndarray) and cell.dtype.kind == "U" and cell.size == 1:
        return str(cell.ravel()[0])
    return None


def _hdf5(source: Source) -> Iterator[tuple[str, NDArray[Any]]]:
    import h5py  # loads slowly: only when wanted

    from hw.records.mat73 import vet_stored

    found: list[tuple[str, NDArray[Any]]] = []

    def take(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or not node.size or name[0] == "#":
            return
        vet_stored(source.file, node, len(source.raw))
        if node.size > DEFAULT_LIMITS.max_samples:
            raise RecordError(f"{source.file}: {name} holds {node.size} numbers")
        if node.dtype == h5py.ref_dtype:
            words = [_text_of(node.file[cell]) for cell in np.ravel(node[()])]
            if all(word is not None for word in words):
                found.append((name.replace("/", "."), np.array(words, dtype=str)))
            return
        text = _text_of(node)
        x = np.array([text]) if text is not None else node[()].T  # MATLAB counts columns first
        if {"real", "imag"} <= set(x.dtype.names or ()):
            x = x["real"] + 1j * x["imag"]
        if x.dtype.kind in "fiucU":
            found.append((name.replace("/", "."), x))

    with h5py.File(io.BytesIO(source.raw), "r") as file:
        file.visititems(take)
    yield from found


def _text_of(node: Any) -> str | None:
    """Return the text of a dataset of characters, "" for an empty one of MATLAB, None for another."""
    if node.attrs.get("MATLAB_empty", 0):
        return ""
    if node.attrs.get("MATLAB_class", b"") != b"char":
        return None
    return "".join(map(chr, np.ravel(node[()].T, order="F")))
