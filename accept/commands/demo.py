"""`accept demo`: the main job on built-in data."""

import time
from pathlib import Path

from accept import batch, seed
from accept.campaign import load_spec
from accept.commands.signing import DEMO, demo_credential
from accept.commands.talk import clear_errors, operator_name, say, stdout
from accept.exit import Exit
from accept.home import home
from accept.rejudge import verify_file
from accept.simulate import write
from accept.simulate.demo import demo_strut
from accept.store import open_store
from accept.table import reasons, units_table


@clear_errors
def run(out: Path, operator: str | None) -> Exit:
    """Judge, certify and verify the seed's seven APAs, as typed in, and a simulated strut from its raw records; the
    exit code says whether the demo went as it must."""
    began = time.monotonic()
    place = home() / DEMO
    credential = demo_credential(home())
    units = [*seed.write_units(out / "units"), _write_strut(out / "units")]
    specs = {"apa": load_spec("apa-basic"), "strut": load_spec("strut-basic")}
    order = batch.Order(units, out, specs, operator_name(operator), credential)
    with open_store(f"sqlite:///{place / 'store.sqlite'}") as store:
        report = batch.run(order, store, say)
    checked = [verify_file(out / u["certificate"], [credential.ca]) for u in report.units]
    apas, struts = ([u for u in report.units if u["kind"] == kind] for kind in ("apa", "strut"))
    stdout.print(units_table(apas, {"published\nflatness um": _published()}))
    stdout.print(units_table(struts))
    print(*reasons(report.units), sep="\n")
    say(f"certificates: {sum(c.valid for c in checked)} of {len(checked)} verified, in {out / batch.CERTIFICATES}")
    say(f"results: {out / 'results.json'}, results.csv, junit.xml ({time.monotonic() - began:.1f} s)")
    return Exit.ACCEPTED if all(c.valid for c in checked) else Exit.REJECTED


def _write_strut(units: Path) -> Path:
    strut = demo_strut()
    return write(strut, units / strut.serial)


def _published() -> dict[str, str]:
    """Table 2.1 of the seed: an optimiser that stopped early; beside it the exact minimum zone that is judged."""
    return {apa.serial: f"{apa.published_flatness_um:g}" for apa in seed.SEED_APAS}
