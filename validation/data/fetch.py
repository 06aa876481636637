"""The finite-element matrices of the shell, on which every blind unit is built: `python -m validation.data.fetch FILE`.

They are public, under the MIT licence ([SUPERELEMENT], `mat/APA300ML.mat` of one commit). The file is checked against
its hash and put where `validation.shell` looks for it; a FILE that is on this machine already, from a clone of that
repository for instance, is checked and copied.
"""

import argparse
import hashlib
import sys
import urllib.error
import urllib.request
from pathlib import Path

from validation.shell import FETCHED, PUBLIC

COMMIT = "32330b92f0052dbb0895207a857b0a85b7b84e06"
URL = f"https://raw.githubusercontent.com/tdehaeze/stewart-simscape/{COMMIT}/mat/APA300ML.mat"
SHA256 = "ebe0eef91153656105f9de2f5ee04f97017cb226fd210233d334d6794d44bece"
PATIENCE_S = 60.0


class FetchError(RuntimeError):
    """A file that could not be had or is another one; the text says which and what to do."""


def checked(content: bytes, source: str) -> bytes:
    """Return the content if it is that of the matrices. Raises FetchError."""
    found = hashlib.sha256(content).hexdigest()
    if found != SHA256:
        raise FetchError(f"{source}: sha256 is {found}, expected {SHA256}: these are other matrices")
    return content


def fetch(source: Path | None = None, to: Path = FETCHED) -> Path:
    """Put the matrices to their place, from a file or from their public address, and return it. Raises FetchError."""
    try:
        if source is not None:
            content = source.read_bytes()
        else:
            with urllib.request.urlopen(URL, timeout=PATIENCE_S) as answer:
                content = answer.read()
    except (OSError, urllib.error.URLError) as e:
        raise FetchError(
            f"{source or URL}: {e}; give the path of a file, as `python -m validation.data.fetch FILE`"
        ) from e
    checked(content, str(source or URL))
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_bytes(content)
    return to


def main() -> int:
    """Fetch, unless the matrices are there."""
    parser = argparse.ArgumentParser(prog="fetch", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("file", type=Path, nargs="?", help="matrices that are on this machine already")
    a = parser.parse_args()
    try:
        place = PUBLIC if PUBLIC.exists() and a.file is None else fetch(a.file)
        checked(place.read_bytes(), str(place))
    except FetchError as e:
        print(e, file=sys.stderr)
        return 6
    print(place)
    return 0


if __name__ == "__main__":
    sys.exit(main())
