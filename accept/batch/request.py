"""What a batch is asked to do: which folders, by which specs, models and calibrations; and the job that this makes of
one unit."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import partial
from pathlib import Path

from accept.base.cluster.work import Cluster
from accept.base.home import home
from accept.batch.worker import Job, judge
from accept.certificate.trust.commissioning import bench_statement
from accept.certificate.trust.keys import Credential
from accept.certificate.trust.provenance import provenance
from accept.gap.start_model import StartModel, applies
from accept.judging import calibration, judge_unit
from accept.judging.calibration import Statement
from accept.models.evidence import evidence_of, hashes, named_models
from accept.store import SignedHead, UnitState
from accept.units import unit_folder
from accept.units.unit_folder import UnitError, UnitFolder
from specs.bench import BenchFile
from specs.spec import Spec

CERTIFICATES = "certificates"


@dataclass(frozen=True)
class BatchRequest:
    """What a batch is asked to do. specs: kind -> spec. credential: None writes no certificates. bench: judge with the
    calibration of its instruments, as it stands `on` a day (UTC). model: explains responses instead of the spec's.
    pool: processes that run already; the longest unit is then judged by this one. For units that are known not to
    break it. cluster: judges instead of processes of this machine. refused: (where, why) of units that did not even
    come this far."""

    paths: Sequence[Path]
    out: Path
    specs: dict[str, Spec]
    operator: str
    credential: Credential | None = None
    workers: int | None = None
    bench: BenchFile | None = None
    on: date = field(default_factory=lambda: datetime.now(UTC).date())
    model: str | None = None
    pool: ProcessPoolExecutor | None = None
    cluster: Cluster | None = None
    refused: Sequence[tuple[str, str]] = ()
    _models: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict, init=False, repr=False)
    _starts: dict[str, StartModel | None] = field(default_factory=dict, init=False, repr=False)

    def calibration(self, folder: UnitFolder) -> Statement | None:
        """Of the instruments behind the checks of a unit, where a bench file is in use."""
        if self.bench is None:
            return None
        stated = bench_statement(self.bench, self.specs[folder.kind].checks, self.on, home())
        return calibration.checked(stated, folder.measured)

    def model_hashes(self, kind: str) -> dict[str, dict[str, str]]:
        """Of the model files that the spec of this kind names: when one changes, so may the verdict."""
        if kind not in self._models:
            self._models[kind] = hashes(evidence_of(named_models(self.specs[kind])))
        return self._models[kind]

    def start(self, folder: UnitFolder) -> StartModel | None:
        """The model that a unit's responses are explained by; None where there is nothing to explain or to explain
        it by."""
        if not applies(folder):
            return None
        if folder.kind not in self._starts:  # opening a model takes most of a second
            self._starts[folder.kind] = StartModel.of(self.specs[folder.kind], self.model)
        return self._starts[folder.kind]

    def certificate(self, serial: str) -> Path:
        """Where a unit's certificate lies."""
        return self.out / CERTIFICATES / f"{serial}.pdf"

    def job(self, folder: UnitFolder, before: UnitState | None, head: SignedHead | None) -> Job:
        """To judge a unit; before: what was known of it; head: of the store."""
        spec = self.specs[folder.kind]
        return partial(
            judge,
            folder,
            spec,
            self.operator,
            stated=self.calibration(folder),
            start=self.start(folder),
            out=self.out,
            provenance=provenance(spec, before, head, home(), self.credential) if self.credential else None,
        )


def spec_for(one: UnitFolder, specs: dict[str, Spec]) -> Spec:
    """Spec of a unit's kind. Raises UnitError when there is none, or the serial is not of the form that it asks for."""
    if one.kind not in specs:
        have = ", ".join(f"{s.name} for '{k}'" for k, s in specs.items())
        raise UnitError(one.path / unit_folder.UNIT_FILE, [f"kind = '{one.kind}' has no spec in this run ({have})"])
    spec = specs[one.kind]
    judge_unit.serial_fits(one, spec)
    return spec
