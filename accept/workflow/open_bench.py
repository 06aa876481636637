"""Opening the workflow's bench: store, specs, instruments, services of screens. Slow to import: only in a thread."""

from collections.abc import Callable, Sequence
from pathlib import Path

from accept import units
from accept.base.home import home
from accept.capture.operator_actions import Person
from accept.judging import default_specs, load_spec
from accept.judging.reservations import serial_doubt, tell_apart
from accept.store import open_store
from accept.units import UnitError
from accept.workflow.bench import Workbench
from accept.workflow.capture import capture
from accept.workflow.certify import Signing, key_problem
from accept.workflow.entry.passphrase_guard import refuse_passphrases
from accept.workflow.instruments.hardware import BenchInstruments
from accept.workflow.instruments.port import Instruments
from accept.workflow.ports import Talk
from accept.workflow.session import Session
from accept.workflow.session.open_session import open_session
from accept.workflow.worker.judging import Elsewhere
from accept.workflow.worker.process import WorkerProcess
from checks.picture import Panel
from specs.bench import load_bench

LOCK_WAIT_S = 5.0  # for another program's hold on the store: then the technician is told


class BenchServices(WorkerProcess):
    """Implements `accept.workflow.ports.Services`, with the process that judges."""

    open_session = staticmethod(open_session)
    refuse_passphrases = staticmethod(refuse_passphrases)
    serial_doubt = staticmethod(serial_doubt)
    tell_apart = staticmethod(tell_apart)
    signing = staticmethod(Signing)
    key_problem = staticmethod(key_problem)

    def computation(self, session: Session, say: Callable[[str], None] = lambda _: None) -> Elsewhere:
        return Elsewhere(self, session, say)

    @staticmethod
    def draw(panels: Sequence[Panel], columns: int) -> bytes:
        from accept.pictures.draw import picture  # matplotlib loads slowly: only when a picture is drawn

        return picture(panels, "svg", columns=columns)

    def measure(self, session: Session, step: str, instruments: Instruments, talk: Talk) -> Sequence[str]:
        actions = instruments.staged or Person(talk.ask)
        recorder = instruments.recording(step)
        return capture(session, step, recorder, actions, talk.say, stopped=talk.stopped, show=talk.show).notes


def open_bench(
    spec: str | None = None, records: Path | None = None, bench_file: Path | None = None, folder: Path | None = None
) -> Workbench:
    """Return the bench of `ACCEPT_HOME`; folder: a unit's, to go on with. Raises SpecError, StoreError, HomeError,
    SettingsError, UnitError."""
    taken = units.read(folder) if folder else None
    specs = [load_spec(spec)] if spec else default_specs()
    if taken is not None and taken.kind not in {one.kind for one in specs}:
        problem = f"kind = '{taken.kind}', but spec {specs[0].name} judges '{specs[0].kind}'"
        raise UnitError(taken.path / units.UNIT_FILE, [problem])
    stated = load_bench(bench_file) if bench_file else None
    instruments = BenchInstruments(stated) if stated else Instruments()
    return Workbench(
        open_store(timeout_s=LOCK_WAIT_S),
        home(),
        {one.kind: one for one in specs},
        BenchServices(),
        instruments,
        records or (Path(stated.rig.folder) if stated and stated.rig else folder) or Path.cwd(),
        stated=stated,
        taken=taken,
        closing=instruments.close,
    )
