"""What no protocol tells is caught by the daily reference, at the instruments that were written apart."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from accept.cli.main import app
from accept.commands.bench import check as command
from tests.hw.apart.table import BENCHES, opened
from tests.hw.apart.wires import Tcp

STEP = 'what = "step block"\nvalue = 100.0\nunit = "um"\nU = 0.2\ncertificate = "S-1"\n'
STANDARD = 'what = "10 uF standard"\nvalue = 10.0\nunit = "uF"\nU = 0.004\ncertificate = "C-1"\n'
UNTOLD = [(name, fault) for name, bench in BENCHES.items() for fault in bench.peer().untold()]
# By as much before the step as after it: lengths hold. The other probe of a formula lies still.
ONLY_SHIFTED = ("formula +1+2", "formula +1-2", "power off and on", "datum set")


def bench_file(folder: Path, name: str, address: str) -> Path:
    """Return the bench file of an instrument with its reference."""
    bench, lines = BENCHES[name], ['name = "bench"', "[instruments.it]", 'measures = ["stroke"]']
    farad = not bench.within
    lines += [f'driver = "{bench.driver}"', f'serial = "{bench.serial or "1"}"']
    place = "link = { baud = 9600, data_bits = 7, parity = 'even', stop_bits = 2, handshake = 'none', port = '%s' }"
    lines.append(f'resource = "{address}"' if bench.resource else place % address)
    lines.append("accuracy = { U_percent = 0.2, source = 'x' }" if farad else "accuracy = { U = 0.5, source = 'x' }")
    lines += ["[instruments.it.settings]", "timeout_s = 2.0", "quiet_s = 0.05", "deadline_s = 20.0"]
    lines += [f"{key} = {repr(value).replace('True', 'true')}" for key, value in bench.settings.items()]
    lines += ["[instruments.it.reference]", STANDARD if farad else STEP]
    path = folder / "bench.toml"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize(("name", "fault"), [*((name, "") for name in BENCHES), *UNTOLD])
def test_the_reference_shows_it(name, fault, tmp_path, monkeypatch):
    """The artefact is measured after something was changed that the instrument does not tell."""
    bench = BENCHES[name]
    wire, driver = opened(bench, tmp_path, 1)
    driver.close()
    peer = wire.peer
    low, high = (0.2e-3, 0.3e-3) if bench.within else (10e-6, 10e-6)
    peer.truth = low
    if fault:
        peer.untold()[fault]()

    def person(words: str) -> str:
        peer.truth = low if "base" in words else high
        return ""

    monkeypatch.setattr(command, "ask_at_terminal", person)
    address = bench.resource.format(port=wire.port) if isinstance(wire, Tcp) else wire.address
    try:
        path = bench_file(tmp_path, name, address)
        done = CliRunner().invoke(app, ["hw", "check", "it", "--bench", str(path)])
    finally:
        wire.close()
    asked = fault.startswith("power") and name == "OPTORSS"  # its unit is then another, which every value tells
    expected = 5 if asked else 0 if not fault or fault in ONLY_SHIFTED else 3
    assert done.exit_code == expected, done.output
