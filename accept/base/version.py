"""The program that judged: its version and the hash of its own code."""

import hashlib
from functools import cache
from importlib import metadata
from pathlib import Path

from accept.base.plain_text import listed
from specs.distribution import NAME
from specs.plugins import packaged, packages

PACKAGES = ("accept", "hw", "checks", "specs")


def version() -> str:
    """Return the version of the installed program."""
    return metadata.version(NAME)


def program() -> str:
    """Return the version with the packages of plug-ins that are used beside it."""
    others = packages()
    return f"{version()} with {listed(others)}" if others else version()


@cache
def code_sha256() -> str:
    """Return the hash over every source file and built-in spec, by path and content, and over packages of plug-ins.

    It changes when a verdict could."""
    root = Path(__file__).resolve().parents[2]
    files = sorted(p for package in PACKAGES for p in (root / package).rglob("*") if p.suffix in {".py", ".toml"})
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    for name, content in packaged():
        digest.update(name.encode() + b"\0" + content + b"\0")
    return digest.hexdigest()
