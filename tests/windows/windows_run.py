"""Run in a process of its own by `test_windows`: this project without the modules and functions that only POSIX has.

The libraries keep theirs (pyserial chooses its port by the system, as does the standard library); whatever accept, hw,
checks or specs ask for is not there, and neither is the timer that Windows' `signal` lacks.
"""

import builtins
import importlib
import os
import pkgutil
import signal
import sys
from pathlib import Path

from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import judge_whole_unit

OURS = ("accept", "hw", "checks", "specs")
POSIX_ONLY = {"fcntl", "termios", "tty", "pty", "resource", "pwd", "grp", "curses", "readline", "posix", "syslog"}
SIGNAL_TIMER = ("SIGALRM", "setitimer", "ITIMER_REAL")

true_import = builtins.__import__


def hidden_import(name, globals=None, locals=None, fromlist=(), level=0):
    asker = (globals or {}).get("__name__", "").partition(".")[0]
    if level == 0 and name.partition(".")[0] in POSIX_ONLY and asker in OURS:
        raise ModuleNotFoundError(f"No module named {name!r} on Windows", name=name)
    return true_import(name, globals, locals, fromlist, level)


def hide() -> None:
    """A finder on `sys.meta_path` would not be asked for what the standard library has already loaded."""
    builtins.__import__ = hidden_import
    for name in SIGNAL_TIMER:
        if hasattr(signal, name):
            delattr(signal, name)


def import_all() -> None:
    for package in OURS:
        for module in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if module.name.endswith("__main__"):
                continue
            try:
                importlib.import_module(module.name)
            except ModuleNotFoundError as e:
                if e.name is None or e.name.partition(".")[0] in (*POSIX_ONLY, *OURS):
                    raise  # else an extra that is not installed


def workflow(folder: Path) -> None:
    """A unit from its first entry to a certificate that verifies."""
    from accept.base.home import home
    from accept.judging import load_spec
    from accept.store import open_store
    from accept.workflow import certify
    from checks.declare import Measured

    with open_store() as store:
        session = open_session(store, home(), load_spec("apa-basic"), "Ann", "APA-02")
        session.begin({})
        for index, z in enumerate((0, -2.5, -3, 0, -1.5, 1, -2, -4)):
            session.entries.take("flatness", session.step("flatness").check.inputs["z_um"], Measured(z), index=index)
        for step, name, value in (
            ("capacitance", "sensor_uF", 4.99),
            ("capacitance", "actuator_uF", 9.85),
            ("stroke", "stroke_um", 365.5),
            ("stiffness", "k_N_per_um", 1.75),
        ):
            session.entries.take(step, session.step(step).check.inputs[name], Measured(value))
        certify.trust.init(session.home, "correct horse", "Ann", "Quinn", "battery staple")
        assert judge_whole_unit(session).verdict == "accepted"
        assert certify.Signing(session).sign("correct horse").valid
        session.close()


def batch_and_certificate(folder: Path) -> None:
    """Judged and certified by the command, and the certificate verified."""
    unit = folder / "units" / "APA-07"
    unit.mkdir(parents=True)
    heights = "[0, -2.5, -3, 0, -1.5, 1, -2, -4]"
    values = "[capacitance]\nsensor_uF = 4.99\nactuator_uF = 9.85\n[stroke]\nstroke_um = 365.5\n"
    text = f'serial = "APA-07"\nkind = "apa"\n[flatness]\nz_um = {heights}\n{values}[stiffness]\nk_N_per_um = 1.76\n'
    (unit / "unit.toml").write_text(text, encoding="utf-8")
    out = folder / "out"
    assert command("batch", str(unit), "--out", str(out), "--spec", "apa-basic", "--operator", "Ann") == 0
    assert command("verify", str(out / "certificates" / "APA-07.pdf")) == 0


def command(*arguments: str) -> int:
    """Exit code of a command of the program."""
    from accept.cli.main import main

    sys.argv = ["accept", *arguments]
    try:
        main()
    except SystemExit as e:
        return int(e.code or 0)
    return 0


def driver(folder: Path) -> None:
    """A reading over a fake port, and a simulated bench that says what it lacks."""
    from hw.errors import SettingsError
    from hw.instruments import Lcr800
    from hw.instruments.lcr800 import Lcr800Settings
    from hw.simulated import Lcr800Device, Server
    from tests.hw.instruments.dialogue import link_to

    meter = Lcr800("lcr", link_to(Lcr800Device(lambda: 4.99e-6)), Lcr800Settings())
    assert abs(meter.read().value - 4.99e-6) < 1e-9
    try:
        with Server(Lcr800Device(lambda: 4.99e-6), folder / "port"):
            raise AssertionError("a pseudo-terminal on Windows")
    except SettingsError as e:
        if "pseudo-terminals" not in str(e):
            raise


if __name__ == "__main__":
    hide()
    import_all()
    for part in (workflow, batch_and_certificate, driver):
        part(Path(sys.argv[1]) if part is workflow else Path(os.environ["ACCEPT_HOME"]).parent)
        print(part.__name__, flush=True)
