"""A certificate of a unit that was judged on a learned bench says so, from the model file that is attached."""

from dataclasses import dataclass, field

import pytest

from accept.base.documents.manifest import ModelFiles
from accept.certificate import Provenance
from accept.certificate.contents.statements import statements

BENCH = b"""[learned_bench]
f_Hz = [10.0, 20.0]
units = ["S-1", "S-2", "S-3"]
learned_on = "2026-11-02"
"""


@dataclass
class Contents:
    """What the statements read of a certificate's content."""

    models: dict[str, ModelFiles]
    spec_name: str = "strut"
    spec_sha256: str = "0" * 64
    stated: Provenance = field(default_factory=Provenance)
    result: dict[str, object] = field(default_factory=lambda: {"findings": [], "verdict": "accepted"})


def said(files: ModelFiles) -> str:
    return statements(Contents({"population.toml": files}))["Models"]  # type: ignore[arg-type]


def test_the_units_and_the_day_of_a_learned_bench_are_stated() -> None:
    words = said({"population.toml": BENCH})
    assert "2026-11-02" in words
    assert "3 units: S-1, S-2, S-3" in words


def test_the_units_of_a_batch_are_stated_without_its_bench() -> None:
    assert "; learned from 2 units: P-1, P-2" in said({"population.toml": b'[population]\nunits = ["P-1", "P-2"]\n'})


@pytest.mark.parametrize("content", [b"name = 'x'", b"\xff\xfe", b"learned_bench = 3", b"= nothing"])
def test_other_files_state_no_bench(content: bytes) -> None:
    words = said({"population.toml": content, "APA.mat": BENCH})
    assert "bench" not in words
    assert "population.toml" in words
