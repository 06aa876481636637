"""A photo of a note, made small enough to be printed on the certificate and to travel with it."""

import io
import warnings
from pathlib import Path

from accept.base.atomic_files import write_atomic
from accept.workflow.entry.parse_entry import EntryError

_MOST_PIXELS = 1200  # of the longer side: 150 to the inch on the width of the page
_QUALITY = 80  # of the JPEG; such a picture has 100 to 300 kB


def scaled(path: Path) -> bytes:
    """Return a photo as a small JPEG, upright and without what the camera wrote beside it. Raises EntryError if it is
    no picture, OSError if it cannot be read."""
    from PIL import Image, ImageOps, UnidentifiedImageError  # loads slowly: only when a picture is printed

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as photo:
                upright = ImageOps.exif_transpose(photo).convert("RGB")
    except (UnidentifiedImageError, Image.DecompressionBombWarning, Image.DecompressionBombError, ValueError) as e:
        raise EntryError(f"{path.name}: no picture that can be printed; keep it as a file without printing it") from e
    upright.thumbnail((_MOST_PIXELS, _MOST_PIXELS))
    small = io.BytesIO()
    upright.save(small, "JPEG", quality=_QUALITY, optimize=True)
    return small.getvalue()


def keep(picture: bytes, folder: Path, name: str) -> str:
    """Write the scaled picture beside the file that it was made of; return its name."""
    shown = f"{Path(name).stem}.print.jpg"
    number = 1
    while (folder / shown).exists() and (folder / shown).read_bytes() != picture:
        number += 1
        shown = f"{Path(name).stem}.print-{number}.jpg"
    write_atomic(folder / shown, picture)
    return shown
