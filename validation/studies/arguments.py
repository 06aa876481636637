"""The command line that the studies share."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from validation.scoring.results_store import Mixed


@contextmanager
def mixed_in_words() -> Iterator[None]:
    """End with one line if the folder holds answers of another version."""
    try:
        yield
    except Mixed as e:
        raise SystemExit(str(e)) from e


def parser_of(doc: str | None, units: int, seed: int) -> argparse.ArgumentParser:
    """Return a parser with --units and --seed. doc: of the study, whose first line says what it does; units, seed: the
    defaults."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=units)
    parser.add_argument("--seed", type=int, default=seed)
    return parser
