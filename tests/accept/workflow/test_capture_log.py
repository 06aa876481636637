"""What a capture says stays where it can be read."""

from accept.tui.screens.capture_dialogue import LAST, CaptureLog


def test_the_cue_stays_above_the_verdicts_of_the_hits() -> None:
    log = CaptureLog()
    assert log.said("x-bending: hit now") == ["x-bending: hit now"]
    for hit in range(1, 8):
        lines = log.said(f"x-bending, hit {hit}: good")
    assert lines == ["x-bending: hit now", *(f"x-bending, hit {hit}: good" for hit in range(8 - LAST, 8))]


def test_another_cue_takes_the_place_of_the_first() -> None:
    log = CaptureLog()
    log.said("closed, 15 s: put the mass on now")
    assert log.said("closed, 22 s: take the mass off now") == ["closed, 22 s: take the mass off now"]


def test_a_question_ends_the_cue_and_leaves_the_last_verdict() -> None:
    log = CaptureLog()
    log.said("x-bending: hit now")
    log.said("x-bending, hit 10: good, 90 N. 10 good; enough")
    assert log.answered() == ["x-bending, hit 10: good, 90 N. 10 good; enough"]
