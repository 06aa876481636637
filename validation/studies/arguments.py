"""The command line that the studies share."""

import argparse


def parser_of(doc: str | None, units: int, seed: int) -> argparse.ArgumentParser:
    """Return a parser with --units and --seed. doc: of the study, whose first line says what it does; units, seed: the
    defaults."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=units)
    parser.add_argument("--seed", type=int, default=seed)
    return parser
