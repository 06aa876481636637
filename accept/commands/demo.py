"""`accept demo`: the main job on built-in data."""

import time
from pathlib import Path

from accept import batch, seed
from accept.campaign import load_spec
from accept.commands.signing import check_certificate, demo_signer
from accept.commands.talk import clear_errors, operator_name, say, stdout
from accept.exit import Exit
from accept.home import home
from accept.store import open_store
from accept.table import units_table

DEMO = "demo"  # keys and events of the demo, apart from those of the bench: a demo must never sign as the bench


@clear_errors
def run(out: Path, operator: str | None) -> Exit:
    """Judge, certify and verify the seed's seven APAs; the exit code says whether the demo went as it must."""
    began = time.monotonic()
    place = home() / DEMO
    signer = demo_signer(place)
    units = seed.write_units(out / "units")
    order = batch.Order(
        units, out, {"apa": load_spec("apa-basic")}, operator_name(operator), signer, demonstration=True
    )
    with open_store(f"sqlite:///{place / 'store.sqlite'}") as store:
        report = batch.run(order, store, say)
    checked = {u["serial"]: check_certificate(out / u["certificate"], signer.trust) for u in report.units}
    stdout.print(units_table(report.units, {"flatness as published [um]": _published()}))
    say(f"certificates: {sum(checked.values())} of {len(report.units)} verified, in {out / batch.CERTIFICATES}")
    say(f"results: {out / 'results.json'}, results.csv, junit.xml ({time.monotonic() - began:.1f} s)")
    return Exit.ACCEPTED if all(checked.values()) else Exit.REJECTED


def _published() -> dict[str, str]:
    """Table 2.1 of the seed: an optimiser that stopped early; beside it the exact minimum zone that is judged."""
    return {apa.serial: f"{apa.published_flatness_um:g}" for apa in seed.SEED_APAS}
