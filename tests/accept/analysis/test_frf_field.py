"""Files of other people, for which `accept frf` printed wrong numbers: each is right or refused with its own reason."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.accept.analysis.test_frf_files import frf

FIELD = Path(__file__).parents[3] / "../shared/field"
STATIC = 2.0001e-6  # m/V at 1 Hz: 2.0e-6 and the resonance at 120 Hz

pytestmark = pytest.mark.needs_data
if not FIELD.is_dir():  # one skip, not one for each file
    pytest.skip("the files of other people (../shared/field) are not beside the repository", allow_module_level=True)

CASES = {
    "09-frf/complex.csv": "", "09-frf/matlabi.csv": "", "09-frf/dbdeg.csv": "", "09-frf/german.csv": "",
    "09-frf/good.csv": "", "09-frf/khz.csv": "", "09-frf/rads.csv": "",
    "09-frf/magphase.csv": "write [deg] or [rad]", "09-frf/neg.csv": "two-sided", "09-frf/mixunit.csv": "two units",
    "09-frf/accel.csv": "unit m/s2, which does not fit",
    "13-uff-164/frf_mm_164.uff": "", "13-uff-164/frf_mm_label.uff": "", "13-uff-164/frf_si.uff": "",
    "14-uff-abscissa/rads.uff": "", "14-uff-abscissa/khz.uff": "", "14-uff-abscissa/rpm.uff": "",
    **{f"16-mat-frd/{n}.mat": "" for n in ("cyc", "default", "hz", "khz", "none", "rads", "rpm", "two")},
    "16-mat-frd/twoin.mat": "2 inputs (Va, Vb)", "16-mat-frd/twoin_nonames.mat": "2 inputs",
    "32-coherence-percent/fraction.csv": "", "32-coherence-percent/percent.csv": "",
    "32-coherence-percent/mvar.csv": "", "32-coherence-percent/umvar.csv": "",
    "32-coherence-percent/percent_nolabel.csv": "is it in percent", "32-coherence-percent/cohdb.csv": "is it in dB",
    "32-coherence-percent/negvar.csv": "not negative", "37-conjugate/conj.csv": "complex conjugate",
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_cases_met_elsewhere(case: str, tmp_path: Path) -> None:
    """Right: 1 to 1000 Hz, 2.0e-6 m/V; the coherence a fraction; or the reason."""
    reason = CASES[case]
    found = frf(FIELD / case, "--averages", 20, "--json", tmp_path / "a.json", code=6 if reason else 0)
    if reason:
        assert reason in found.stderr
        return
    one = json.loads((tmp_path / "a.json").read_text())["responses"][0]
    assert one["f_Hz"][0] == pytest.approx(1.0, rel=1e-5)  # six digits in a universal file
    assert one["f_Hz"][-1] == pytest.approx(1000.0, rel=1e-5)
    H = one["H"]["de"]
    assert abs(complex(H["re"][0], H["im"][0])) == pytest.approx(STATIC, rel=1e-4)
    assert (one["input"], one["units"]["de"]) == ("Va", "m")
    if "var" in case:
        assert one["var"]["de"][0] ** 0.5 == pytest.approx(0.01 * STATIC, rel=1e-3)  # 1 % of |H|
    if case.startswith("32") and "var" not in case:
        assert one["coherence"]["de"][0] == pytest.approx(0.98726, abs=1e-5)


def test_a_genuine_file_of_an_analyser(tmp_path: Path) -> None:
    found = frf(FIELD / "60-dataphysics/hammer_point.mat", "--json", tmp_path / "a.json")
    one = json.loads((tmp_path / "a.json").read_text())["responses"][0]
    assert list(one["H"]) == ["H1_2", "H1_3", "H1_4"]
    assert len(one["f_Hz"]) == 1601
    assert one["units"] == {"force": "N", "H1_2": "g", "H1_3": "g", "H1_4": "g"}
    assert all(0.9 < np.median(one["coherence"][c]) <= 1.0 for c in one["H"])
    assert "per N of channel 1" in found.stderr
