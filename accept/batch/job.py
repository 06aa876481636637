"""One unit to be judged, and the outcome: plain data, so that another process or machine can do it."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from accept.base.console import say as say_on_stderr
from accept.base.documents.results import UnitRecord
from accept.base.watchdog import TimeLimitExceeded, judging_s, time_limit
from accept.base.worker_process import too_large
from accept.certificate import CertificateContent, ContentError, Provenance, content_of
from accept.gap.start_model import StartModel, applies
from accept.judging.calibration import Statement
from accept.judging.judge_unit import judge_unit
from accept.store import BENCH_KEY, bench_of
from accept.store.payloads import PlaceInBatch
from accept.units.loaded_unit import contents_of, loaded
from accept.units.unit_folder import UnitError, UnitFolder
from specs.spec import Spec

QUIET_S = 2.0  # what takes less needs no words

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Judgement:
    """The judgement of a unit, before the store's reservations. result: with its pictures only if a certificate is
    wanted; files: those that it attaches, as they were judged, by name; the others are read again."""

    result: UnitRecord
    files: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Refusal:
    """A unit that could not be judged, and why."""

    reason: str


@dataclass(frozen=True, eq=False)
class UnitJob:
    """One unit to be judged.

    stated : the calibration of the instruments behind it, None without a bench file. start : the model that explains
    its responses, None if there is nothing to explain. out : folder of the results; an improved model goes below it.
    certificate : the file wanted, None for none. home, bench : folder and public key of the bench that certifies it.
    uncertified : number of the stored judgement that only lacks its certificate. place : where the unit stands in its
    batch, None without one. reason : why it is judged again, "" if no reason was given, None if none is asked for.
    """

    unit: UnitFolder
    spec: Spec
    operator: str
    stated: Statement | None = None
    start: StartModel | None = None
    out: Path | None = None
    certificate: Path | None = None
    home: Path = Path()
    bench: str = ""
    uncertified: int | None = None
    place: PlaceInBatch | None = None
    reason: str | None = None

    def judge(self, say: Say = lambda _: None) -> Judgement:
        """Judge the unit, explain its responses, and hand on the files that its certificate attaches. Raises UnitError,
        ContentError."""
        held = loaded(self.unit)
        result = judge_unit(held, self.spec, self.stated)
        if self.start is not None and applies(self.unit):
            from accept.gap.attach_to_result import explain_result  # loads the search for what is missing

            result = explain_result(result, held, self.start, say, self.out)
        if self.certificate is None:
            return Judgement(replace(result, panels={}))
        if self.bench and bench_of(self.home / BENCH_KEY) != self.bench:  # another machine: the bench reads them itself
            return Judgement(result)
        contents = self.contents(Judgement(result, contents_of(held)))
        return Judgement(replace(result, panels=contents.pictures), contents.files)

    def run(self) -> "Judgement | Refusal":
        """Judge the unit for a batch, which goes on with the next unit if this one cannot be judged."""
        limit = judging_s()
        try:
            with time_limit(limit):
                return self.judge(_progress(self.unit.serial))
        except TimeLimitExceeded:
            return Refusal(f"{self.unit.path}: judging it took more than {limit:g} s and was stopped (ACCEPT_UNIT_S)")
        except (UnitError, ContentError) as e:
            return Refusal(str(e))
        except MemoryError:
            return Refusal(f"{self.unit.path}: {too_large()}")

    def contents(self, judgement: Judgement, stated: Provenance | None = None) -> CertificateContent:
        """Return what the certificate of a judgement states. Raises ContentError if an input is gone or was changed."""
        result, folder = judgement.result, self.unit.path
        return content_of(result, self.spec, folder, self.operator, held=judgement.files, provenance=stated)


def _progress(serial: str) -> Say:
    """Return a function that reports on stderr what a unit is waiting for, no more often than a person reads."""
    said = time.monotonic()

    def seldom(words: str) -> None:
        nonlocal said
        if time.monotonic() - said > QUIET_S:
            said = time.monotonic()
            say_on_stderr(f"{serial}: {words}")

    return seldom
