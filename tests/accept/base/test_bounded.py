"""Work in a process that is ended: after its time, in the midst of a call of C, and beyond its memory."""

import os
import re
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext

import pytest

from accept.base.child_processes import Exhausted, bounded
from accept.base.watchdog import TimeLimitExceeded, time_limit
from accept.certificate.verify.kept_child import kept_child


@pytest.fixture(autouse=True, params=["once", "kept"])
def kept(request: pytest.FixtureRequest) -> Iterator[bool]:
    is_kept = request.param == "kept"
    with kept_child() if is_kept else nullcontext():
        yield is_kept


def words_of(text: str) -> list[str]:
    return text.split()


def refuse(_: str) -> None:
    raise KeyError("not there")


def match_for_ever(_: str) -> bool:
    return re.fullmatch("(a+)+b", "a" * 60) is not None  # one call of C, which no signal handler of Python interrupts


def fill(_: str) -> int:
    return len(bytearray(2_000_000_000))


def test_the_answer_and_the_error_come_back() -> None:
    assert bounded(words_of, "a b", seconds=5, gigabytes=0.3) == ["a", "b"]
    with pytest.raises(KeyError, match="not there"):
        bounded(refuse, "", seconds=5, gigabytes=0.3)


def test_it_is_ended_in_the_midst_of_a_call() -> None:
    began = time.process_time()
    with pytest.raises(Exhausted, match="more than 1 s"):
        bounded(match_for_ever, "", seconds=1, gigabytes=0.3)
    assert time.process_time() - began < 1  # of this process, which only waits


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the memory of a process")
def test_it_gets_no_more_memory() -> None:
    with pytest.raises(Exhausted, match=r"0\.3 GB"):
        bounded(fill, "", seconds=5, gigabytes=0.3)


def process(seconds: float) -> int:
    began = time.process_time()
    while time.process_time() - began < seconds:
        pass
    return os.getpid()


def sleep_and_say(seconds: float, words: str) -> str:
    time.sleep(seconds)
    return words


def large(count: int) -> bytes:
    return bytes(count)


def test_a_kept_process_answers_several_times_each_within_limits_of_its_own(kept: bool) -> None:
    """2.4 s together, each allowed 2 s, of which a system counts whole ones."""
    found = {bounded(process, 0.8, seconds=2, gigabytes=0.3) for _ in range(3)}
    assert len(found) == (1 if kept and sys.platform == "linux" else 3)


@pytest.mark.parametrize("wrong", [refuse, fill, match_for_ever])
def test_what_fails_leaves_no_process_to_another_call(wrong: object) -> None:
    before = bounded(process, 0.0, seconds=5, gigabytes=0.3)
    with pytest.raises((KeyError, Exhausted)):
        bounded(wrong, "", seconds=1, gigabytes=0.3)  # type: ignore[arg-type]
    assert bounded(process, 0.0, seconds=5, gigabytes=0.3) != before


def test_an_answer_that_nobody_waits_for_any_more_is_not_that_of_the_next_call() -> None:
    with pytest.raises(TimeLimitExceeded), time_limit(0.3):
        bounded(sleep_and_say, 5.0, "late", seconds=5, gigabytes=0.3)
    assert bounded(sleep_and_say, 0.0, "in time", seconds=5, gigabytes=0.3) == "in time"


def test_a_process_that_has_grown_is_not_asked_again() -> None:
    before = bounded(process, 0.0, seconds=5, gigabytes=0.3)
    assert len(bounded(large, 150_000_000, seconds=5, gigabytes=0.6)) == 150_000_000
    assert bounded(process, 0.0, seconds=5, gigabytes=0.3) != before


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks, so only there one is kept")
def test_the_process_ends_with_the_last_that_keeps_it(kept: bool) -> None:
    with kept_child():
        there = bounded(process, 0.0, seconds=5, gigabytes=0.3)
        with kept_child():
            assert bounded(process, 0.0, seconds=5, gigabytes=0.3) == there
    with nullcontext() if kept else pytest.raises(ProcessLookupError):
        os.kill(there, 0)
