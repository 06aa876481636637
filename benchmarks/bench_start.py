"""Start of the commands beside their bare imports, as ratios of processor time: python benchmarks/bench_start.py

Required: any command until its first output at most 1.5 times its bare imports, `accept verify` of a certificate, with
the page drawn and the unit judged again, at most 2 times importing numpy, pyHanko, reportlab and typer.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERIFY = "import numpy, typer, reportlab.platypus, pyhanko.sign.validation"
SHOW = "import typer, rich.table; from pydantic import BaseModel"
TYPED = """serial = "T-01"
kind = "apa"
[capacitance]
sensor_uF = 5.10
actuator_uF = 9.8
"""
REPEATS = 5


def seconds(arguments: list[str], environment: dict[str, str]) -> float:
    """Least processor time of a process."""
    took = []
    for _ in range(REPEATS):
        before = os.times()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=False, cwd=ROOT, env=environment)
        after = os.times()
        took.append(after.children_user + after.children_system - before.children_user - before.children_system)
    return min(took)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        environment = os.environ | {"ACCEPT_HOME": name, "ACCEPT_PASSPHRASE": "benchmark", "OPENBLAS_NUM_THREADS": "1"}
        unit = place / "T-01"
        unit.mkdir()
        (unit / "unit.toml").write_text(TYPED)
        out = place / "out"
        run = ["-m", "accept"]
        seconds([*run, "batch", str(unit), "--spec", "apa-basic", "--out", str(out)], environment)
        certificate = out / "certificates" / "T-01.pdf"
        rows = [
            ("accept verify", [*run, "verify", str(certificate)], VERIFY, 2.0),
            ("accept --help", [*run, "--help"], "import typer, rich.console", 1.5),
            ("accept spec show", [*run, "spec", "show", "apa"], SHOW, 1.5),
        ]
        print(f"a certificate was made: {certificate.exists()}")
        for words, arguments, bare, limit in rows:
            least, took = seconds(["-c", bare], environment), seconds(arguments, environment)
            ratio = f"{took / least:.1f} times (required <= {limit})"
            print(f"{words:20} {took:.2f} s, bare imports {least:.2f} s: {ratio}")


if __name__ == "__main__":
    main()
