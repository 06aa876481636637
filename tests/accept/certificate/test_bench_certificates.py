"""Benches have certificates of the authority; an unknown bench is exit 4, and a second home with copied keys is one."""

import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from accept.base.home import home
from accept.base.names import same_person, scripts
from accept.certificate import read_contents
from accept.certificate.trust import keys
from accept.certificate.trust.keys import KeysError
from accept.commands.trust import bench_keys
from accept.commands.trust import keys as commands
from tests.accept.certificate.certificate_help import stated_head
from tests.accept.certificate.verify.test_statements import accept, certified, forged, plainly, replaced, verified


@pytest.fixture
def authority(monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bench whose authority's passphrase is known to its owner alone."""
    monkeypatch.setenv("ACCEPT_CA_PASSPHRASE", "authority phrase")
    return keys.init(home(), "correct horse", "Test Technician", authority_passphrase="authority phrase")


def test_a_head_of_an_invented_bench_is_not_valid(authority: Path, tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    invented = stated_head(12345, Ed25519PrivateKey.generate())
    bare = {k: v for k, v in contents.provenance.items() if k not in ("bench", "signature", "authority")}
    for number, made in enumerate(
        (replace(contents, provenance=bare | {"head": invented}), replaced(contents, head=invented))
    ):
        done = verified(forged(tmp_path / f"{number}.pdf", made))
        assert done.exit_code == (4, 3)[number], done.output
        assert "unknown bench" in done.output or "another bench" in done.output


def test_what_a_bench_states_cannot_be_changed_without_its_key(authority: Path, tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    assert contents.provenance["authority"] == "its key lies at this bench"
    for change in ({"attempt": 2}, {"authority": "off the bench"}):
        made = replace(contents, provenance={**contents.provenance, **change})
        assert verified(forged(tmp_path / "f.pdf", made)).exit_code == 3
    silent = {k: v for k, v in contents.provenance.items() if k != "authority"}
    assert verified(forged(tmp_path / "f.pdf", replace(contents, provenance=silent))).exit_code == 3


def test_a_second_home_with_copied_keys_is_another_bench(
    authority: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measure until it passes, with the product's own commands."""
    first, second = home(), tmp_path / "second"
    certified(tmp_path, "T-1", serial="T-1", stroke=265.5)
    shutil.copytree(first / "keys", second / "keys")
    monkeypatch.setenv("ACCEPT_HOME", str(second))
    warned = accept("report", tmp_path / "T-1", "--spec", "apa-basic", "--out", tmp_path / "w.pdf")
    assert "this bench has no certificate of the authority" in warned.stderr
    pdf = certified(tmp_path, "T-1", serial="T-1", stroke=366.1)
    for place in (second, first):
        monkeypatch.setenv("ACCEPT_HOME", str(place))
        done = verified(pdf, "--require", "accepted")
        assert (done.exit_code, "unknown bench" in done.stdout) == (4, True), done.output


def test_a_bench_is_certified_renewed_and_revoked(
    authority: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    second = tmp_path / "second"
    shutil.copytree(home() / "keys", second / "keys")
    monkeypatch.setenv("ACCEPT_HOME", str(second))
    assert "has no certificate of the authority" in accept("keys", "list").stderr
    assert accept("keys", "request", "--role", "bench", "--name", "bench 2").exit_code == 0
    asked = second / "keys" / "bench.request.pem"
    issued = accept("keys", "issue", asked)
    assert issued.exit_code == 0, issued.output
    listed = accept("keys", "list")
    assert "bench 2" in listed.stdout
    assert "the authority's key lies at this bench" in listed.stderr
    pdf = certified(tmp_path, "T-1", serial="T-1")
    done = verified(pdf)
    assert plainly(done), done.output
    assert "made at bench 2" in done.stderr
    assert accept("keys", "renew", "bench 2").exit_code == 0
    assert accept("keys", "revoke", "bench 2", "--reason", "lost").exit_code == 0
    done = verified(pdf)
    assert (done.exit_code, "bench 2, was revoked" in done.stdout) == (4, True), done.output


def test_a_technician_is_no_bench(authority: Path, tmp_path: Path) -> None:
    contents = read_contents(certified(tmp_path, "B-1").read_bytes())
    technician = (authority / "technician.pem").read_text()
    done = verified(forged(tmp_path / "f.pdf", replaced(contents, bench=technician)))
    assert (done.exit_code, "certificate of a technician" in done.stdout) == (3, True), done.output


def test_the_passphrase_of_the_authority_is_read_from_no_file_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ACCEPT_CA_PASSPHRASE", raising=False)
    assert plainly(verified(certified(tmp_path, "A-1")))  # makes the keys, unattended
    left = keys.folder(home()) / keys.AUTHORITY_PASSPHRASE
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    assert accept("keys", "request", "--role", "qa", "--name", "Grace").exit_code == 0
    request = keys.folder(home()) / "qa-grace.request.pem"
    assert accept("keys", "issue", request).exit_code == 6
    assert accept("keys", "issue", request, "--passphrase-file", left).exit_code == 0


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("Ada", "Ad\u0430", True),  # Cyrillic
        ("root", "r\u043e\u043et", True),
        ("\u0421\u043e\u0441\u043e", "Coco", True),  # Cyrillic throughout
        ("Ada  Lovelace", "ADA LOVELACE", True),
        ("Ian", "lan", True),
        ("Harn", "Ham", True),
        ("Grace Hopper", "Ada Lovelace", False),
        ("M. Keller", "N. Keller", False),
        ("Åström", "Aström", False),
    ],
)
def test_names_that_read_the_same_are_of_one_person(one: str, other: str, same: bool) -> None:
    assert same_person(one, other) is same


def test_a_name_has_letters_of_one_script() -> None:
    for name in ("Ad\u0430", "\u0391da"):
        with pytest.raises(KeysError, match="several scripts"):
            keys.check_name(name)
    with pytest.raises(KeysError, match="without '='"):  # read as a role in a list of names of certificates
        keys.check_name("Bob,OU=technician")
    for name in ("Åsa Øst", "\u0410\u043d\u043d\u0430", "O'Brien-Núñez 2", "Wang 王"):
        keys.check_name(name)
        assert len(scripts(name)) <= 1


def commands_of_the_page(stick: Path, pdf: Path, request: Path) -> list[list[str]]:
    """Return the five commands of docs/explanation/signing.md, with folders of this test."""
    page = (Path(__file__).parents[3] / "docs" / "explanation" / "signing.md").read_text()
    section = page.partition("### The authority off the bench, in five commands")[2]
    lines = [shlex.split(line) for line in section.splitlines() if line.startswith("    accept ")]
    places = {"/media/qa/authority": str(stick), "grace.request.pem": str(request), "UNIT.pdf": str(pdf)}
    return [[places.get(word, word) for word in words[1:]] for words in lines]


def test_the_authority_off_the_bench_in_five_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the page has them."""
    monkeypatch.setenv("ACCEPT_CA_PASSPHRASE", "authority phrase")
    monkeypatch.setenv("ACCEPT_QA_PASSPHRASE", "battery staple")
    monkeypatch.delenv("ACCEPT_OPERATOR")
    stick, pdf = tmp_path / "stick" / "authority", tmp_path / "A-1.pdf"
    *first, countersign = commands_of_the_page(stick, pdf, tmp_path / "grace.request.pem")
    assert len(first) == 4
    for words in first:
        done = accept(*words)
        assert done.exit_code == 0, done.output
    assert "Grace Hopper" in done.stdout
    assert "authority's key lies at this bench" not in done.stderr
    assert {path.name for path in stick.glob("*.pem")} == {"ca.pem", "ca.crl.pem", "ca.key.pem"}
    assert not (home() / "keys" / "ca.key.pem").exists()
    assert certified(tmp_path, "A-1", serial="A-1") == pdf
    assert accept(*countersign).exit_code == 0
    done = verified(pdf, "--require", "accepted,countersigned,approved,current")
    assert plainly(done), done.output
    assert "authority's key" not in done.stderr
    again = accept("keys", "init", "--technician", "Ada", "--authority", stick)
    assert (again.exit_code, "there are keys already" in again.stderr) == (6, True)


def test_an_authority_that_cannot_be_written_leaves_no_keys(tmp_path: Path) -> None:
    (tmp_path / "stick").write_text("no folder")
    done = accept("keys", "init", "--technician", "Ada", "--authority", tmp_path / "stick")
    assert (done.exit_code, "cannot be written" in done.stderr) == (6, True), done.output
    assert not keys.exist(home())


def test_new_passphrases_are_typed_twice_and_the_authority_has_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At a terminal; a mistyped one would open nothing."""
    for name in ("ACCEPT_PASSPHRASE", "ACCEPT_CA_PASSPHRASE"):
        monkeypatch.delenv(name, raising=False)
    typed: list[str] = []
    monkeypatch.setattr(bench_keys, "terminal_prompt", lambda words: typed.pop(0))
    monkeypatch.setattr(bench_keys.sys, "stdin", SimpleNamespace(isatty=lambda: True))

    def made(*words: str) -> int:
        typed[:] = words
        return int(commands.init("Ada", None, None, None))

    assert made("correct horse", "correct hoarse") == 6
    assert made("correct horse", "correct horse", "correct horse", "correct horse") == 6
    assert not keys.exist(home())
    assert made("correct horse", "correct horse", "authority phrase", "authority phrase") == 0
    assert keys.unlock(home(), "technician", "correct horse").person == "Ada"
