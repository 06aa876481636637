"""Work in a process that is ended: after its time, in the midst of a call of C, and beyond its memory."""

import re
import sys
import time

import pytest

from accept.base.child_processes import Exhausted, bounded


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
