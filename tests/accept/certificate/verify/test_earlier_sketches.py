"""A certificate of an earlier program, whose sketches of samples have fewer parts, is compared by the parts it has."""

from dataclasses import replace
from pathlib import Path

import pytest

from accept.base.version import code_sha256
from accept.certificate import InvalidCertificate, content_of
from accept.certificate.verify.attachments import check_result
from accept.certificate.verify.rejudge import read_unit
from accept.judging import judge_unit, load_spec
from accept.units import unit_folder
from accept.units.unit_folder import UNIT_FILE
from tests.accept.batch.test_copies import unit
from tests.accept.units.units import LOOPS


def test_sketches_without_turning_points(tmp_path: Path) -> None:
    """Not those of this program, which has them, and no others than the attached samples give."""
    (tmp_path / "loops.toml").write_text(LOOPS)
    spec = load_spec(str(tmp_path / "loops.toml"))
    folder = unit(tmp_path / "A-1", "A-1", 1)
    earlier = judge_unit(unit_folder.read(folder), spec)
    fewer = earlier.samples
    more = {name: {key: f"{text}:AAAAAA==" for key, text in texts.items()} for name, texts in fewer.items()}
    judged = replace(earlier, samples=more)
    contents = content_of(judged, spec, folder, "Ann")
    before = replace(contents, result={**contents.result, "samples": fewer}, code_sha256="0" * 64)
    attached = read_unit(contents.files[UNIT_FILE])
    assert check_result(before, attached, judged) is not None
    with pytest.raises(InvalidCertificate):
        check_result(replace(before, code_sha256=code_sha256()), attached, judged)
    forged = {name: {key: f"X{text[1:]}" for key, text in texts.items()} for name, texts in fewer.items()}
    with pytest.raises(InvalidCertificate):
        check_result(replace(before, result={**before.result, "samples": forged}), attached, judged)
