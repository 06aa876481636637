"""LabVIEW measurement files by their public description, as its "Write To Measurement File" writes them."""

import pytest

from tests.statements.case import Case, cell
from tests.statements.plant import FS, late, record


def lvm(multi: bool = False, x0: float = 0.0, dx: float = 1.0 / FS, columns: str = "One", decimal: str = ".") -> str:
    """Return a measurement file by its public description: header, header of the segment, values."""
    made = late() if x0 else record()
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
        f"Decimal_Separator\t{decimal}",
        f"Multi_Headings\t{'Yes' if multi else 'No'}", f"X_Columns\t{columns}", "Time_Pref\tRelative", "Operator\tAnn",
        "Date\t2026/11/20", "Time\t10:00:00.0000000", "***End_of_Header***\t", "\t",
        "Channels\t2\t\t", "Samples\t3600\t3600\t", "Date\t2026/11/20\t2026/11/20\t",
        "Time\t10:00:00.0000000\t10:00:00.0000000\t", "Y_Unit_Label\tV\tm\t", "X_Dimension\tTime\tTime\t",
        f"X0\t0.0\t{x0!r}\t", f"Delta_X\t{dx!r}\t{dx!r}\t", "***End_of_Header***\t\t\t",
    ]  # fmt: skip
    if columns == "Multi":
        head.append("X_Value\tVa\tX_Value\tde\tComment")
        rows = [f"{t:.6f}\t{u:.9g}\t{t + x0:.6f}\t{y:.9g}\t" for t, u, y in zip(*made.values(), strict=True)]
    elif columns == "No":
        head.append("X_Value\tVa\tde\tComment")
        rows = [f"\t{u:.9g}\t{y:.9g}\t" for u, y in zip(made["Va"], made["de"], strict=True)]
    else:
        head.append("X_Value\tVa\tde\tComment")
        rows = [f"{t:.6f}\t{u:.9g}\t{y:.9g}\t" for t, u, y in zip(*made.values(), strict=True)]
    text = "\r\n".join(rows)
    return "\r\n".join(head) + "\r\n" + (text.replace(".", decimal) if decimal != "." else text) + "\r\n"


@cell("LabVIEW .lvm", "layout", "header, X_Columns = {id}")
@pytest.mark.parametrize("columns", ["One", "No", "Multi"])
def test_lvm(case: Case, columns: str) -> None:
    case.record(case.text("r.lvm", lvm(columns=columns)), ["LabVIEW", "lvm"])


@cell("LabVIEW .lvm", "layout", "the same as .txt")
def test_lvm_as_txt(case: Case) -> None:
    case.record(case.text("r.txt", lvm()), ["LabVIEW", "lvm", "line 1", "first line", "preamble"])


@cell("LabVIEW .lvm", "scale", "Decimal_Separator = comma")
def test_lvm_with_commas(case: Case) -> None:
    case.record(case.text("r.lvm", lvm(decimal=",")), ["LabVIEW", "lvm"])


@cell("LabVIEW .lvm", "start", "X0 of de is 5 ms, X_Columns = {id}")
@pytest.mark.parametrize("columns", ["No", "Multi"])
def test_lvm_start(case: Case, columns: str) -> None:
    case.record(case.text("r.lvm", lvm(x0=5e-3, columns=columns)), ["LabVIEW", "lvm", "X0", "start"])


@cell("LabVIEW .lvm", "increment", "Delta_X contradicts the column of time")
def test_lvm_increment(case: Case) -> None:
    case.record(case.text("r.lvm", lvm(dx=2.0 / FS)), ["LabVIEW", "lvm", "Delta_X"], H=None)
