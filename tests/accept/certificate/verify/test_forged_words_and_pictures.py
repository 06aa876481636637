"""Forgeries by an insider beside the numbers: what the page states and shows, specs whose names look like another's,
and a store that was made unusable so that nobody can ask it."""

import re
import sqlite3
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from accept.base.home import home
from accept.certificate import CertificateContent, InvalidCertificate, Validity, read_contents, rejudge
from accept.certificate.page.document import render
from accept.certificate.signature.signing import sign
from accept.certificate.trust import keys
from accept.certificate.trust.keys import TECHNICIAN
from accept.certificate.verify.picture_check import SEEN, check_gap, check_pictures, own_words
from accept.judging import judge
from accept.pictures.reduce import reduce_panel
from accept.units.unit_folder import parse
from checks.gap import EFFECTS
from checks.gap.decision.panels import magnitude_panel, residual_panel
from checks.gap.modelling.experiment import Experiment
from checks.picture import Line, Mark, Panel, Span, Text
from specs.spec import builtin
from specs.strict import toml_of
from tests.accept.certificate.certificate_help import WHEN
from tests.accept.certificate.verify.test_forged_from_inside import accept, judged, reported, written
from tests.accept.certificate.verify.verify_help import NOW, Bench, refused, verify


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> CertificateContent:
    return judged(tmp_path_factory.mktemp("honest") / "unit")


# --- what the page states, verified where there is no store to ask ---------------------------------------------------


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        ({"spec_name": "apa-basic, approved edition"}, "another name"),
        ({"spec_title": "All measurements of an APA"}, "another title"),
        ({"instruments": {"capacitance": "a better meter"}}, "another list of instruments"),
        ({"operator": "Grace"}, "but M. Keller signed as technician"),
        ({"statement": "Tested by the national institute of metrology."}, "what this program does not say"),
    ],
)
def test_the_page_states_what_is_attached(
    bench: Bench, honest: CertificateContent, lie: dict[str, object], words: str
) -> None:
    def verified(contents: CertificateContent) -> object:
        return verify(sign(render(contents), bench.technician, WHEN), bench.trust, rejudge, NOW)

    refused(verified(replace(honest, **lie)), words)  # type: ignore[arg-type]


DECIDED = {
    "who": "Grace",
    "time": "2026-11-23T10:00:00+00:00",
    "reason": "the verdict was withdrawn, the unit is ACCEPTED",
    "measured": [["APA-02", "stroke/x"]],
}


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        ({"copies": [{"sample": "review/x", "with": [], "withheld": True, "resolved": DECIDED}]}, "none of that name"),
        (
            {"copies": [{"sample": "flatness/typed values", "with": [], "withheld": True, "resolved": DECIDED}]},
            "not signed by quality assurance",
        ),
        (
            {
                "copies": [
                    {
                        "sample": "flatness/typed values",
                        "with": [{"serial": "the unit is", "sample": "ACCEPTED"}],
                        "withheld": True,
                        "resolved": None,
                    }
                ]
            },
            "not named as a record",
        ),
        ({"folder": {"name": "APA-03", "confirmed_by": "Grace: the unit is ACCEPTED"}}, "did not sign"),
        ({"folder": {"name": "by mistake, the unit is ACCEPTED", "confirmed_by": "M. Keller"}}, "is not one"),
    ],
)
def test_words_in_the_name_of_another_person_are_not_plainly_valid(
    bench: Bench, honest: CertificateContent, lie: dict[str, object], words: str
) -> None:
    """What weakens a verdict costs a rejected unit nothing, and the page prints it."""
    forged = replace(honest, result={**honest.result, **lie})
    if "copies" in lie:
        forged = replace(forged, result=rejudge(forged).to_json())
    found = verify(sign(render(forged), bench.technician, WHEN), bench.trust, rejudge, NOW)
    assert (found.outcome, words in found.reason) == (Validity.SIGNED, True), found


def shifted(panel: Panel) -> Panel:
    """Its first curve a twentieth of its height up."""
    curve = next(item for item in panel.items if isinstance(item, Line) and item.y.size > 1)
    moved = replace(curve, y=curve.y + 0.05 * float(curve.y.max() - curve.y.min()))
    return replace(panel, items=tuple(moved if item is curve else item for item in panel.items))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: {k: v for k, v in p.items() if k != "flatness/zone"}, "was left out"),
        (lambda p: p | {"flatness/zone": shifted(p["flatness/zone"])}, "does not show the attached records"),
        (lambda p: p | {"flatness/zone": replace(p["flatness/zone"], title="ACCEPTED")}, "does not show"),
        (lambda p: p | {"more": p["flatness/zone"]}, "picture more does not show"),
        (lambda p: p | {"gap/x": Panel("x", "", "", (Text(0, 0, "unit ACCEPTED"),))}, "says 'ACCEPTED'"),
    ],
)
def test_the_pictures_show_the_attached_records(
    bench: Bench,
    honest: CertificateContent,
    change: Callable[[dict[str, Panel]], dict[str, Panel]],
    words: str,
) -> None:
    """They are drawn from data of their own, which the hashes of the records do not cover."""
    forged = replace(honest, panels=change(dict(honest.panels)))
    refused(verify(sign(render(forged), bench.technician, WHEN), bench.trust, rejudge, NOW), words)


@pytest.mark.parametrize(
    ("gap", "words"),
    [
        ({"start": "strut", "verdict": "refused", "reason": "withdrawn; the unit is accepted"}, "no responses"),
        (None, "not of the stated gap analysis"),
    ],
)
def test_a_gap_analysis_is_of_responses_and_brings_its_own_pictures(
    bench: Bench, honest: CertificateContent, gap: dict[str, object] | None, words: str
) -> None:
    """Its search is not repeated, so an insider writes what he likes into it: not where nothing can be analysed."""
    if gap is None:
        remark = Panel("the verdict was withdrawn, the unit is accepted", "", "", ())
        forged = replace(honest, panels={**honest.panels, "gap/de magnitude": remark})
    else:
        forged = replace(honest, result={**honest.result, "gap": gap | {"model_sha256": None}})
    refused(verify(sign(render(forged), bench.technician, WHEN), bench.trust, rejudge, NOW), words)


FITTED = {
    "verdict": "explained",
    "gap_before": {"channels": {"de": 9.0}},
    "where": [{"channel": "de", "f_lo_Hz": 170.0, "f_hi_Hz": 215.0, "p": 1e-9, "excess_dB": 14.2}],
    "unnamed": [{"channel": "de", "poles_Hz": [191.6], "zeros_Hz": [], "level_dependent": False}],
}
CURVE = np.linspace(1.0, 2.0, 5), np.linspace(1.0, 2.0, 5)
CROSSTALK = {
    "effect": "crosstalk",
    "sentence": EFFECTS["crosstalk"].say({"V_per_V": 1.2e-5}, {"V_per_V": 1e-7}),
    "parameters": {"V_per_V": {"value": 1.2e-5, "ci95": [1.19e-5, 1.21e-5]}},
}
LATE = {"samples": {"value": 2.0, "ci95": [2.0, 2.0]}}
NAMED = {"effect": "sensor_polarity", "sentence": EFFECTS["sensor_polarity"].sentence, "parameters": {}}


@pytest.mark.parametrize(
    ("named", "title", "words"),
    [
        (NAMED, "de / Va", None),
        (NAMED, "de / Va: the unit is good", "says 'de / Va: the unit is good'"),
        (NAMED, "THE_UNIT_IS_ACCEPTED: what is left", "says 'THE_UNIT_IS_ACCEPTED: what is left'"),
        (
            {
                "effect": "crosstalk",
                "sentence": EFFECTS["crosstalk"].sentence.format(V_per_V="\u0410\u0421\u0421\u0415\u0420\u0422\u0415"),
            },
            "de / Va",
            "in words that are not its own",
        ),  # Cyrillic letters for a number
        (
            {"effect": "dead_channel", "sentence": "THE_UNIT_IS_ACCEPTED_it does not answer the drive."},
            "de / Va",
            "in words that are not its own",
        ),
        (NAMED | {"sentence": "The unit is accepted all the same."}, "de / Va", "in words that are not its own"),
        (NAMED | {"effect": "goodwill"}, "de / Va", "in words that are not its own"),
        (NAMED | {"parameters": {"the unit is accepted": {}}}, "de / Va", "the parameter 'the unit is accepted'"),
        ({"effect": "dead_channel", "sentence": "Vs does not answer the drive."}, "de / Va", None),
        (CROSSTALK, "de / Va", None),
        (  # red before: any number passed
            CROSSTALK | {"sentence": EFFECTS["crosstalk"].say({"V_per_V": 3e-7}, {"V_per_V": 1e-7})},
            "de / Va",
            "in words that are not its own",
        ),
        (CROSSTALK | {"parameters": {}}, "de / Va", "in words that are not its own"),  # red before
        (
            {"effect": "sample_offset", "sentence": "de comes 2 samples late.", "parameters": LATE},
            "de / Va",
            None,
        ),
        (  # red before
            {"effect": "sample_offset", "sentence": "de comes 3 samples late.", "parameters": LATE},
            "de / Va",
            "in words that are not its own",
        ),
        (  # red before: the effect of a fault could be any
            {"effect": "goodwill", "sentence": "Vs does not answer the drive."},
            "de / Va",
            "in words that are not its own",
        ),
        (  # as it was worded when the certificate was made
            {
                "effect": "sensor_pickup",
                "sentence": "The derivative of the amplifier's output, times -2.97 us, adds to Vs.",
                "parameters": {"tau_us": {"value": -2.9743, "ci95": [-2.99, -2.96]}},
            },
            "de / Va",
            None,
        ),
    ],
)
def test_a_gap_analysis_speaks_in_the_words_of_the_library(
    named: dict[str, str], title: str, words: str | None, tmp_path: Path
) -> None:
    panel = replace(magnitude_panel("de", CURVE, CURVE, CURVE), title=title)
    with pytest.raises(InvalidCertificate, match=words) if words else nullcontext():
        checked(tmp_path, {"parameters": {}, **named}, {"gap/de magnitude": panel})


def checked(folder: Path, named: dict[str, object], panels: dict[str, Panel]) -> None:
    text = b'serial = "S-1"\nkind = "strut"\n[frf]\nlow = "a.mat"\nhigh = "b.mat"\n'
    check_gap(parse(folder, text, toml_of(text)), FITTED | {"named": [named]}, panels)


RESIDUAL = residual_panel("de", CURVE, CURVE, CURVE, [(170.0, 215.0)], [191.6])


def with_item(panel: Panel, kind: type, **changes: object) -> Panel:
    """With another first item of a kind."""
    first = next(item for item in panel.items if isinstance(item, kind))
    return replace(panel, items=tuple(replace(i, **changes) if i is first else i for i in panel.items))


@pytest.mark.parametrize(
    ("name", "panel", "words"),
    [
        ("de residual", RESIDUAL, None),
        ("de residual", with_item(RESIDUAL, Mark, label="pole 12.0 Hz"), "says 'pole 12.0 Hz'"),  # red before
        ("de residual", with_item(RESIDUAL, Mark, at=12.0), "marks what the analysis does not state"),  # red before
        ("de residual", with_item(RESIDUAL, Span, lo=400.0, hi=500.0), "marks what"),  # red before
        ("de residual", with_item(RESIDUAL, Line, label="after"), "marks what"),  # red before: before for after
        ("de residual", replace(RESIDUAL, items=RESIDUAL.items[1:]), "marks what"),  # red before
        ("de residual", replace(RESIDUAL, items=(*RESIDUAL.items, Text(0, 0, "good"))), "says 'good'"),
        ("de magnitude", RESIDUAL, "does not have the curves"),
        ("Vs residual", RESIDUAL, "not of the stated gap analysis"),
    ],
)
def test_a_picture_of_a_gap_shows_what_is_stated_beside_it(
    name: str, panel: Panel, words: str | None, tmp_path: Path
) -> None:
    with pytest.raises(InvalidCertificate, match=words) if words else nullcontext():
        checked(tmp_path, NAMED, {f"gap/{name}": panel})


@pytest.mark.parametrize(("channel", "words"), [("all", None), ("ALL", "names a channel 'ALL'")])
def test_an_effect_in_the_drive_is_of_all_channels(channel: str, words: str | None, tmp_path: Path) -> None:
    """Red before: the certificate of a unit with one was refused."""
    text = b'serial = "S-1"\nkind = "strut"\n[frf]\nlow = "a.mat"\nhigh = "b.mat"\n'
    gap = {"verdict": "unexplained", "named": [], "unnamed": [{"channel": channel}]}
    with pytest.raises(InvalidCertificate, match=words) if words else nullcontext():
        check_gap(parse(tmp_path, text, toml_of(text)), gap, {})


def test_a_gap_analysis_states_what_this_program_writes(tmp_path: Path) -> None:
    text = b'serial = "S-1"\nkind = "strut"\n[frf]\nlow = "a.mat"\nhigh = "b.mat"\n'
    with pytest.raises(InvalidCertificate, match="states 'verdict_of_unit', which this program does not write"):
        check_gap(parse(tmp_path, text, toml_of(text)), {"verdict": "refused", "verdict_of_unit": "accepted"}, {})


RIVALS = ["amplifier_bandwidth", "loop_delay"]
FOUND = {"start": "strut", "model": "strut", "verdict": "ambiguous", "ambiguous": [], "unnamed": []}


@pytest.mark.parametrize(
    ("gap", "fields"),
    [
        (FOUND, []),
        (FOUND | {"ambiguous": [{"effects": RIVALS, "experiment": Experiment.MASS.value}]}, []),
        (FOUND | {"ambiguous": [{"effects": RIVALS, "experiment": "none: the unit is ACCEPTED"}]}, ["gap.ambiguous"]),
        (
            FOUND | {"ambiguous": [{"effects": ["the unit is ACCEPTED"], "experiment": Experiment.MASS.value}]},
            ["gap.ambiguous"],
        ),
        (FOUND | {"unnamed": [{"channel": "de", "words": "the unit is ACCEPTED"}]}, ["gap.unnamed"]),
        (FOUND | {"unnamed": [{"channel": "de"}]}, []),
        (FOUND | {"model": "of the institute, which ACCEPTED the unit"}, ["gap.start"]),
        (FOUND | {"start": "/home/strut.toml"}, ["gap.start"]),  # typed, so it is not attached
        ({"start": "strut", "verdict": "refused", "reason": "it was ACCEPTED by hand"}, ["gap.reason"]),
    ],
)
def test_what_a_gap_analysis_says_in_words_of_its_own_is_known(
    honest: CertificateContent, gap: dict[str, object], fields: list[str]
) -> None:
    assert own_words(replace(honest, result={**honest.result, "gap": gap})) == fields


@pytest.mark.parametrize(
    "lie",
    [
        {"part_doubts": ["the verdict below was withdrawn, the unit is ACCEPTED"]},
        {"nonconformances": ["a scratch, released by Grace: the unit is ACCEPTED"], "verdict": "conditional"},
    ],
)
def test_reservations_that_neither_store_nor_list_shows_are_not_plainly_valid(
    bench: Bench, honest: CertificateContent, lie: dict[str, object]
) -> None:
    """They make the verdict no better, but the page prints them."""
    forged = replace(honest, result={**honest.result, **lie})
    forged = replace(forged, result=rejudge(forged).to_json())
    found = verify(sign(render(forged), bench.technician, WHEN), bench.trust, rejudge, NOW)
    assert (found.outcome, next(iter(lie)) in found.reason) == (Validity.SIGNED, True), found


def test_pictures_of_another_processor_are_the_same() -> None:
    """Its sums differ in the seventh digit, and of two samples as high it may keep the other one; a shift is seen."""
    x = np.linspace(0.0, 1.0, 200)

    def drawn(bump: int) -> dict[str, Panel]:
        y = np.sin(9 * x) * (1 + 1e-6 * (bump > 0))
        y[50 : 50 + bump] = y[51 : 51 + bump]  # the next sample
        return {"stroke/loop": Panel("Loop", "x", "y", (Line(x, y, "0.123456 um"),))}

    check_pictures(drawn(0), drawn(3))
    with pytest.raises(InvalidCertificate, match="does not show the attached records"):
        check_pictures(drawn(0), drawn(20))


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("value", [1e7, 1.9, -0.3, np.nan, np.inf])  # of curves from 0 to 1
def test_no_point_of_a_picture_is_free(axis: str, value: float) -> None:
    """Red before: two points in a hundred could be anything, so the scale made the curve a flat line."""
    turn = np.linspace(0.0, 2 * np.pi, 400)
    loop = Line(0.5 - 0.5 * np.cos(turn), 0.5 - 0.5 * np.cos(turn - 0.2), "loop")
    changed = np.array(getattr(loop, axis))
    changed[200:204] = value  # 1 % of them
    again, shown = (
        {"stroke/loop": Panel("Loop", "x", "y", (item,))} for item in (loop, replace(loop, **{axis: changed}))
    )
    with pytest.raises(InvalidCertificate, match="does not show the attached records"):
        check_pictures(shown, again)


@pytest.mark.parametrize("seed", range(6))
def test_another_sample_as_high_is_the_same_picture(seed: int) -> None:
    """Red if no point were free: where two samples of a run are as high but for rounding, another processor keeps the
    other one, at another abscissa."""
    turn, rng = np.linspace(0.0, 10 * np.pi, 100_000), np.random.default_rng(seed)
    y = np.round(np.sin(turn) + 0.05 * rng.standard_normal(turn.size), 3)  # as a converter rounds: some are as high

    def drawn(processor: int) -> Panel:
        sums = y * (1 + 1e-14 * np.random.default_rng(processor).standard_normal(turn.size))
        return reduce_panel(Panel("Loop", "x", "y", (Line(np.cos(turn), sums),)))

    one, other = drawn(1), drawn(2)
    assert np.abs(one.items[0].x - other.items[0].x).max() > 2 * SEEN  # type: ignore[union-attr]  # a line
    check_pictures({"stroke/loop": one}, {"stroke/loop": other})


# --- specs whose names look like another's ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["APA-Basic", "apa-basic ", "apa\u2010basic", "apa-basic\u200b", "\uff41pa-basic"])
def test_a_name_that_looks_like_a_built_in_one_is_not_plainly_valid(tmp_path: Path, name: str) -> None:
    own, pdf = tmp_path / "own.toml", tmp_path / "a.pdf"
    text = builtin()["apa-basic"].read_text().replace('"apa-basic"', f'"{name}"')
    own.write_text(text.replace("lower = 4.4", "lower = 0.1"))
    reported = accept("report", written(tmp_path / "u", 1.72), "--spec", own, "--out", pdf)
    if name != "APA-Basic":  # letters that only look alike, and spaces, are in no name of a spec
        assert (reported.exit_code, "expected 1 to 64 letters" in reported.output) == (6, True), reported.output
        return
    done = accept("verify", pdf)
    assert (done.exit_code, "bears the name of a built-in" in done.stdout) == (4, True), done.output


def test_the_first_line_says_that_nobody_approved_the_spec(tmp_path: Path) -> None:
    """What a script or a hasty reader sees is that line."""
    own, pdf = tmp_path / "own.toml", tmp_path / "a.pdf"
    accept("spec", "copy", "apa-basic", own)
    accept("report", written(tmp_path / "u", 4.99), "--spec", own, "--out", pdf)
    done = accept("verify", pdf)
    assert (done.exit_code, "spec NOT APPROVED" in done.stdout) == (0, True), done.output


def test_a_name_writes_no_part_of_the_first_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Red before: a name of 900 characters pushed NOT APPROVED out of the line and wrote an approval into it. Judged
    by a program that takes any name; `accept report` refuses it, and a certificate of such a spec is not valid."""
    own, pdf = tmp_path / "own.toml", tmp_path / "a.pdf"
    lie = f"apa-basic 447fd242d761; signed by Grace as qa; spec approved by quality assurance; {'limits ' * 120}"
    own.write_text(builtin()["apa-basic"].read_text().replace('"apa-basic"', f'"{lie}"'))
    assert accept("report", written(tmp_path / "u", 4.99), "--spec", own, "--out", pdf).exit_code == 6
    with monkeypatch.context() as patch:
        patch.setattr(judge, "NAME", re.compile(".*"))
        accept("report", tmp_path / "u", "--spec", own, "--out", pdf)
    line = accept("verify", pdf).stdout.splitlines()[0]
    assert line.startswith("NOT VALID: the attached unit cannot be judged: the attached spec: name = 'apa-basic"), line
    assert lie not in line


# --- a store that cannot be asked ------------------------------------------------------------------------------------


def unknown_to_the_store(folder: Path) -> Path:
    """Signed with the technician's own key by a program of his own, at another second: in the same one it is the same
    file to the byte."""
    contents = read_contents(reported(folder).read_bytes())
    pdf = folder / "b.pdf"
    later = datetime.now(UTC) + timedelta(seconds=2)
    pdf.write_bytes(sign(render(contents), keys.unlock(home(), TECHNICIAN, "correct horse"), later))
    return pdf


def edit(store: Path) -> None:
    with sqlite3.connect(store) as database:
        for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
            database.execute(f"DROP TRIGGER {name}")
        database.execute("UPDATE events SET who = 'Eve' WHERE seq = 1")
    database.close()


def remove(store: Path) -> None:
    for file in store.parent.glob("store.*"):
        file.unlink()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (edit, "could not be asked"),
        (lambda store: store.write_bytes(b"no database" * 999), "could not be asked"),
        (remove, "its store is gone"),
    ],
    ids=["edited", "overwritten", "removed"],
)
def test_whoever_breaks_the_store_gains_nothing(tmp_path: Path, spoil: Callable[[Path], object], words: str) -> None:
    """A certificate that the store never heard of is not plainly valid because the store cannot say so any more."""
    pdf = unknown_to_the_store(tmp_path)
    assert accept("verify", pdf).exit_code == 4
    spoil(home() / "store.sqlite")
    done = accept("verify", pdf)
    assert (done.exit_code, words in done.stdout) == (4, True), done.output
