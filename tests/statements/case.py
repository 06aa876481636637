"""A file is put to the doors of the program: its number is right, or it is refused in words that name the statement."""

import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import accept
from accept.cli.main import app
from tests.statements.plant import BAND, H_de

STATEMENTS = ("start", "increment", "unit", "scale", "label", "kind", "quality", "layout")
PAGE = Path(__file__).parents[2] / "docs" / "reference" / "statements.md"
# What a library says when a file is not what its caller took it for, and the advice that sends people to measure again.
NO_REASON = re.compile(
    r"codec|could not convert|zero-size|Traceback|\w+Error\b|tokenizing|invalid literal|cannot reshape|broadcast"
    r"|has no attribute|not supported between|unsupported operand|out of bounds|not subscriptable|record again"
)


def cell(form: str, statement: str, text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a test its row of the page; `{id}` in the text stands for the parameter's name."""
    assert statement in STATEMENTS, statement

    def marked(test: Callable[..., Any]) -> Callable[..., Any]:
        test.cell = (form, statement, text)  # type: ignore[attr-defined]
        return test

    return marked


Response = Callable[[np.ndarray], np.ndarray]
Truth = Response | dict[str, Response] | None  # of the only output, or by channel; None: no number can be right


@dataclass
class Case:
    """One file before the program: keeps what became of it, "used" or "refused", for the page."""

    folder: Path
    outcome: set[str] = field(default_factory=set)

    def path(self, name: str) -> Path:
        return self.folder / name

    def text(self, name: str, text: str, encoding: str = "utf-8") -> Path:
        """Write a text as its program would: the bytes are those of the text."""
        self.path(name).write_bytes(text.encode(encoding))
        return self.path(name)

    # What became of it

    def refused(self, reason: str, words: Sequence[str]) -> None:
        """Assert that a refusal names the statement, in no library's words, and sends nobody to measure again."""
        reason = reason.rpartition("accept: ")[2]  # what was taken from the file stands above it
        reason = " ".join(reason.replace(f"{self.folder}/", "").replace("│", " ").split())
        self.outcome.add("refused")
        foreign = NO_REASON.search(reason)
        assert foreign is None, f"refused in no words of its own ({foreign.group()!r}): {reason}"
        own = re.sub(r"\b(it holds)\b.*", r"\1", reason, flags=re.IGNORECASE)  # a list of all names names no statement
        named = any(re.search(rf"\b{w}\b" if re.fullmatch(r"\w{1,3}", w) else w, own, re.IGNORECASE) for w in words)
        assert named, f"refused without naming the statement ({' or '.join(words)}): {reason}"

    def used(self) -> None:
        self.outcome.add("used")

    def run(self, *words: object, codes: Sequence[int] = (0, 6)) -> tuple[int, str]:
        """Call a command in this process: its exit code and all that it printed."""
        done = CliRunner().invoke(app, [str(w) for w in words], env={"COLUMNS": "2000"})
        said = done.output.strip()
        assert done.exit_code in codes, f"exit {done.exit_code}: {said} {done.exception!r}"
        return done.exit_code, said

    # Doors

    def frf(
        self,
        *files: Path,
        words: Sequence[str],
        H: Truth = H_de,
        options: Sequence[object] = (),
        within: float = 1e-3,
        band: tuple[float, float] = BAND,
        check: Callable[[dict[str, Any]], None] | None = None,
        said: str = "",
    ) -> dict[str, Any] | None:
        """Compute or read a response by `accept frf`: right in the band, or refused.

        within: part of |H|. Text keeps nine digits and a lost sample changes the phase at 50 Hz by 8 %, so 1e-3 is both
        far above the one and far below the other. said: words that must
        stand beside a number that is used.
        """
        out = self.path("frf.json")
        code, told = self.run("frf", *files, *options, "--json", out)
        if code == 6:
            self.refused(told, words)
            return None
        assert H is not None, f"taken, though no number can be right: {told}"
        (response,) = json.loads(out.read_text())["responses"]
        truth = H if isinstance(H, dict) else dict.fromkeys(response["H"], H)
        if not isinstance(H, dict):
            assert len(response["H"]) == 1, f"one output was recorded, not {list(response['H'])}"
        assert set(truth) == set(response["H"]), f"outputs {list(response['H'])}, not {list(truth)}"
        for channel, right in truth.items():
            values = response["H"][channel]
            got = np.array(values["re"], dtype=float) + 1j * np.array(values["im"], dtype=float)
            compare(np.array(response["f_Hz"], dtype=float), got, right, within, band, f"{channel}; {told}")
        if check:
            check(response)
        assert re.search(said, told, re.IGNORECASE), f"used without a word ({said}): {told}"
        self.used()
        return response

    def record(
        self,
        path: Path,
        words: Sequence[str],
        channels: dict[str, str] | None = None,
        within: float = 1e-3,
        **more: Any,
    ) -> None:
        """Put a record to `accept frf` and to `accept.frequency_response` of `accept.read_record`: right, or refused,
        and both doors agree."""
        named = [w for ours, theirs in (channels or {}).items() for w in ("--map", f"{ours}={theirs}")]
        response = self.frf(path, words=words, options=named, within=within, **more)
        try:
            again = accept.frequency_response(accept.read_record(path, channels=channels))
        except accept.AcceptError as error:
            if response is not None:
                pytest.fail(f"accept frf takes what accept.read_record refuses: {error}")
            self.refused(str(error), words)
            return
        assert response is not None, "accept frf refuses what accept.read_record takes"
        compare(again.frf.f, again.frf.H[:, again.frf.channels.index("de")], H_de, within, BAND, "read_record")

    def response(
        self,
        path: Path,
        words: Sequence[str],
        H: Truth = H_de,
        within: float = 1e-6,
        options: Sequence[object] = (),
        **more: Any,
    ) -> dict[str, Any] | None:
        """Put a file of responses to `accept frf` and `accept.read_response`: right, or refused, and both agree.

        within: nothing is estimated, so what differs is the digits of the file.
        """
        read = self.frf(path, words=words, H=H, within=within, options=options, **more)
        if options:
            return read
        try:
            again = accept.read_response(path)
        except accept.AcceptError as error:
            if read is not None:
                pytest.fail(f"accept frf takes what accept.read_response refuses: {error}")
            self.refused(str(error), words)
            return None
        assert read is not None, "accept frf refuses what accept.read_response takes"
        assert H is not None
        for channel, right in (H if isinstance(H, dict) else dict.fromkeys(again.frf.channels, H)).items():
            compare(
                again.frf.f, again.frf.H[:, again.frf.channels.index(channel)], right, within, BAND, "read_response"
            )
        return read

    def unit(
        self,
        folder: Path,
        quantity: str,
        right: float | None,
        within: float,
        words: Sequence[str],
        alone: bool = True,
    ) -> None:
        """Judge a unit folder by `accept batch`: the quantity is right, or it is no result with the reason.

        right: None where no number can be. alone: no other section is there, so that what to do is about this one.
        """
        out = self.path("out")
        code, said = self.run("batch", folder, "--out", out, "--no-certificates", codes=(0, 3, 4, 6))
        units = json.loads((out / "results.json").read_text())["units"] if (out / "results.json").exists() else []
        if code == 6 or not units:
            self.refused(said, words)
            return
        everything = units[0]["findings"] + units[0].get("information", [])
        found = [f for f in everything if f["quantity"] == quantity]
        if not found:
            assert units[0]["verdict"] in ("incomplete", "conditional"), f"{quantity} is not judged: {said}"
            self.refused(said + json.dumps(units[0].get("not_judged")), words)
            return
        (finding,) = found
        if finding["value"] is None or finding["verdict"] == "no_result":
            assert finding["verdict"] == "no_result", finding
            self.refused(str(finding["reason"]), words)
            todo = next((x for x in said.splitlines() if "what to do" in x), "")
            assert not alone or "record again" not in todo, f"sends people to measure again: {todo} {finding['reason']}"
            return
        assert right is not None, f"taken, though no number can be right: {quantity} = {finding['value']}"
        assert finding["value"] == pytest.approx(right, rel=within), f"{finding['value']} is not {right}: {finding}"
        self.used()

    def table(
        self,
        command: Sequence[str],
        path: Path,
        right: dict[str, float] | None,
        within: float,
        words: Sequence[str],
        *more: object,
    ) -> None:
        """Evaluate a table by `accept gauge` or `accept rr`: each named number is right, or the table is refused.

        right: None where no number can be.
        """
        out = self.path("table.json")
        code, said = self.run(*command, path, "--json", out, *more, codes=(0, 3, 4, 6))
        if code == 6:
            self.refused(said, words)
            return
        assert right is not None, f"taken, though no number can be right: {said}"
        answer = json.loads(out.read_text())
        for dotted, value in right.items():
            got: Any = answer
            for key in dotted.split("."):
                got = got[key]
            assert got == pytest.approx(value, rel=within), f"{dotted} = {got}, not {value}: {said}"
        self.used()


def compare(
    f: np.ndarray,
    H: np.ndarray,
    right: Response,
    within: float,
    band: tuple[float, float],
    where: str,
) -> None:
    """Assert that the response has lines from end to end of the band and is right at each of them."""
    there = (f >= band[0]) & (f <= band[1]) & np.isfinite(H)
    assert there.sum() >= 10, f"{there.sum()} lines from {band[0]} to {band[1]} Hz: {where}"
    assert f[there].min() < band[0] + 20.0, where
    assert f[there].max() > band[1] - 20.0, where
    wrong = np.abs(H[there] / right(f[there]) - 1.0)
    worst = int(wrong.argmax())
    assert wrong[worst] <= within, (
        f"wrong without a word: at {f[there][worst]:g} Hz {H[there][worst]:.4g} stands for "
        f"{right(f[there])[worst]:.4g}: {where}"
    )


def coherent(value: float) -> Callable[[dict[str, Any]], None]:
    """Return a check that the first output has this coherence at every line."""

    def check(answer: dict[str, Any]) -> None:
        got = np.array(next(iter(answer["coherence"].values())), dtype=float)
        np.testing.assert_allclose(got, value, err_msg="the file's coherence is lost or changed")

    return check


def key(request: pytest.FixtureRequest) -> str:
    """Return the name by which the page has this test."""
    return f"{request.path.name}::{request.node.name}"


@pytest.fixture
def case(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Case]:
    """A folder for the file of a test; afterwards the page must say what became of it."""
    made = Case(tmp_path)
    row = getattr(request.function, "cell", None)
    spec = getattr(request.node, "callspec", None)
    if row is not None:
        text = row[2].replace("{id}", spec.id if spec else "")
        request.node.user_properties.append(("row", [row[0], row[1], text, key(request)]))
    yield made
    outcome = " and ".join(sorted(made.outcome, reverse=True))
    request.node.user_properties.append(("outcome", outcome or "open"))
    report = getattr(request.node, "called", None)
    if row is not None and report is not None and report.passed and "ACCEPT_STATEMENTS" not in os.environ:
        line = next((x for x in PAGE.read_text(encoding="utf-8").splitlines() if f"`{key(request)}`" in x), "")
        assert f"| {outcome} |" in line, (
            f"{key(request)} is {outcome} now: renew {PAGE.name} (python -m tests.statements)"
        )
