"""Jobs of units, done in this process, in another one or on another machine."""

import time
from dataclasses import replace

from accept.base.console import say as say_on_stderr
from accept.base.watchdog import TimeLimitExceeded, judging_s, time_limit
from accept.base.worker_process import too_large
from accept.batch.ports import Judgement, JudgingOrder, Refusal, Say
from accept.certificate import CertificateContent, ContentError, Provenance, content_of
from accept.judging import judge_unit, without_bench_errors
from accept.store import BENCH_KEY, bench_of
from accept.units import UnitError, contents_of, loaded

QUIET_S = 2.0  # what takes less needs no words


class UnitJob(JudgingOrder):
    """Judges a unit as the bench does."""

    def judge(self, say: Say = lambda _: None) -> Judgement:
        held = loaded(self.unit)
        result = judge_unit(held, self.spec, self.stated)
        if self.start is not None:
            from accept.gap import explain_result  # loads the search for what is missing

            result = without_bench_errors(explain_result(result, held, self.start, say, self.out))
        if self.certificate is None:
            return Judgement(replace(result, panels={}))
        if self.bench and bench_of(self.home / BENCH_KEY) != self.bench:  # another machine: the bench reads them itself
            return Judgement(result)
        contents = self.contents(Judgement(result, contents_of(held)))
        return Judgement(replace(result, panels=contents.pictures), contents.files)

    def run(self) -> Judgement | Refusal:
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
