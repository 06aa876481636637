"""Certificates that another program has saved again: not valid, and said to be that."""

import shutil
import subprocess

import pytest
from pypdf import PdfReader, PdfWriter

from tests.statements.case import Case
from tests.statements.test_unit_folder import HEIGHTS, unit


@pytest.mark.parametrize("program", ["pypdf", "qpdf --linearize", "mutool"])
def test_certificate_that_was_saved_again(case: Case, program: str) -> None:
    path, saved = case.path("U-1.pdf"), case.path("saved.pdf")
    case.run("report", unit(case, f"[flatness]\nz_um = {HEIGHTS}"), "--out", path, codes=(0, 3, 4))
    if program == "pypdf":
        with saved.open("wb") as file:
            PdfWriter(clone_from=PdfReader(path)).write(file)
    else:
        tool, *options = program.split()
        if shutil.which(tool) is None:
            pytest.skip(f"no {tool}")
        between = [*options, str(path), str(saved)] if tool == "qpdf" else ["clean", str(path), str(saved)]
        subprocess.run([tool, *between], check=True, capture_output=True)
    _, said = case.run("verify", saved, codes=(3, 4, 6))
    case.refused(said, ["saved", "rewritten", "another program"])
