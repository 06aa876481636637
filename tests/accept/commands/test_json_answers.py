"""`--json` of commands that list or show: one typed document each, in a file or on stdout in place of the text."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.base.documents import listings
from accept.base.home import home
from accept.certificate.trust import keys
from accept.cli.lazy_group import Command, Group
from accept.cli.main import COMMANDS, app
from accept.store import open_store
from accept.store.formats import DOCUMENTS
from checks.cause import Cause, because
from checks.gap import EFFECTS
from specs.model import builtin_models
from specs.plugins import products
from specs.spec import builtin, load

ROOT = Path(__file__).parents[3]
BENCH = """name = "bench 1"
[instruments.encoder]
driver = "offline"
measures = ["frf"]
serial = "VIONIC-7"
calibration = { certificate = "R-1", due = 2020-01-15 }
[instruments.probe]
driver = "nd287"
measures = ["flatness"]
link = { port = "/dev/absent", baud = 9600, data_bits = 7, parity = "even", stop_bits = 2, handshake = "none" }
settings = { axis = "single", range_mm = [-13.0, 13.0] }
"""
WORDS = {  # what each needs beside its name, and its exit code
    "hw test": (("--bench", "{bench}"), 5),
    "hw list": (("--bench", "{bench}"), 0),
    "spec show": (("strut",), 0),
    "spec diff": (("strut", "strut-basic"), 4),
    "recall": (("--instrument", "VIONIC-7", "--since", "2026-01-01"), 4),
    "verify": (("{file}",), 3),
    "golden check": ((), 3),
}
LISTED = {
    name.split("`")[1].removeprefix("accept ").removesuffix(" --json"): kind
    for name, kind in DOCUMENTS.items()
    if kind.__module__ == listings.__name__ and name.startswith("`accept ")  # not a file that a command writes
}
GOLDENS = [
    listings.GoldenCompared("APA-01", "accepted", True, ("sensor_uF is off",)),
    listings.GoldenCompared("APA-02", "accepted", False, ()),
]
# Commands that print an answer and have no document: they write files, talk to a person, or their text is the format.
WITHOUT = {
    "demo", "batch", "report", "countersign", "evidence", "run", "gap", "excite sweep", "excite noise", "excite sine",
    "excite multisine", "model export", "model learn", "lookup build", "simulate bench", "simulate unit",
    "hw commission", "hw transcript", "hw measure", "hw pickup", "spec validate", "spec check", "spec checks",
    "spec copy", "spec approve", "product new", "product check", "keys init", "keys request", "keys issue",
    "keys install", "keys revoke", "keys renew", "keys passphrase", "store head", "store publish", "store copies",
    "store resolve", "store void", "store dispose", "store backup", "store restore", "golden name", "golden resolve",
    "golden retire", "site", "worker",
}  # fmt: skip


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A bench with keys and one event."""
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "file").write_bytes(b"no certificate")
    monkeypatch.setattr("accept.commands.fleet.bench_health.check_goldens", lambda *_: GOLDENS)
    keys.init(home(), "correct horse", "Ann")
    with open_store() as store:
        store.append("step_noted", "APA-01", {"reason": "dusty"}, who="Ann")
    return tmp_path


def run(place, name, *more):
    words, code = WORDS.get(name, ((), 0))
    filled = [word.format(bench=place / "bench.toml", file=place / "file") for word in words]
    done = CliRunner().invoke(app, [*name.split(), *filled, *more])
    assert done.exit_code == code, done.output
    return done.stdout


@pytest.mark.parametrize("name", LISTED)
def test_the_document_in_a_file_beside_the_text_or_on_stdout_alone(name, place):
    kind = LISTED[name]
    text = run(place, name)
    printed = run(place, name, "--json", "-")
    document = kind.from_text(printed)
    assert json.loads(printed) == document.to_json()
    again = run(place, name, "--json", str(place / "made" / "a.json"))
    written = kind.from_text((place / "made" / "a.json").read_bytes())
    changing = re.compile(r"\d+\.\d+")  # seconds that an instrument took
    assert changing.sub("", again) == changing.sub("", text)
    if name != "hw test":
        assert written == document


def test_documents_hold_what_is_there(place):
    def document(name):
        return LISTED[name].from_text(run(place, name, "--json", "-"))

    assert [s.name for s in document("spec list").specs] == list(builtin())
    assert {limit.quantity for limit in document("spec show").limits} == {
        quantity for check in load("strut").checks.values() for quantity in check.limits
    }
    assert [p.name for p in document("product list").products] == list(products())
    assert [m.name for m in document("model list").models] == list(builtin_models())
    assert [e.name for e in document("model effects").effects] == list(EFFECTS)
    encoder, probe = document("hw list").instruments
    assert (encoder.name, encoder.there, encoder.calibrated_until) == ("encoder", None, "2020-01-15")
    assert encoder.days_left < 0
    assert (probe.place, probe.there, probe.days_left) == ("/dev/absent", False, None)
    (asked,) = document("hw test").instruments
    assert (asked.name, asked.value) == ("probe", None)
    assert "/dev/absent" in asked.problem
    assert {(key.role, key.person) for key in document("keys list").keys} >= {("technician", "Ann")}
    (event,) = document("store log").events
    assert (event.subject, event.who, event.payload) == ("APA-01", "Ann", {"reason": "dusty"})
    assert document("store check").holds
    assert [(g.serial, g.measured, g.problems) for g in document("golden check").units] == [
        (g.serial, g.measured, g.problems) for g in GOLDENS
    ]
    assert document("verify").outcome == "not_valid"
    assert not document("recall").known


def test_a_misalignment_goes_to_stdout_too(place, monkeypatch):
    """A file called - was written."""
    monkeypatch.chdir(place)
    monkeypatch.setattr("accept.commands.physics.misalign._unit_or_response", lambda unit: (unit, "S-1"))
    reason = because(Cause.IN_WORDS, detail="too few lines")
    monkeypatch.setattr("accept.commands.physics.misalign.estimate_or_reason", lambda *_: reason)
    done = CliRunner().invoke(app, ["misalign", "S-1", "--json", "-"])
    assert done.exit_code == 4, done.output
    assert json.loads(done.stdout)["reason"] == "too few lines"
    assert not Path("-").exists()


def test_a_place_that_cannot_be_written_is_said_before_the_work(place):
    done = CliRunner().invoke(app, ["spec", "list", "--json", str(place)])
    assert done.exit_code == 6
    assert done.stdout == ""


def test_every_command_has_a_document_or_is_named_here():
    def named(table, before=""):
        for name, entry in table.items():
            yield from named(entry.commands, f"{name} ") if isinstance(entry, Group) else [(before + name, entry)]

    page = (ROOT / "docs" / "reference" / "cli.md").read_text()
    sections = dict(re.findall(r"^#+ `?accept ([a-z ]+?)`?\n(.*?)(?=^#|\Z)", page, re.MULTILINE | re.DOTALL))
    every = {name for name, entry in named(COMMANDS) if isinstance(entry, Command)}
    with_json = {name for name, text in sections.items() if "`--json`" in text}
    assert every - with_json == WITHOUT
