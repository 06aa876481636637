"""`accept demo`: the main job on built-in data.

The seven APAs of [STB], as typed in, and a simulated strut from its raw records are judged, certified and verified; a
model is learned from three struts of its batch, and the hidden effect of the judged strut is named. The exit code
states whether the demo succeeded."""

import json
import time
from pathlib import Path
from typing import Annotated

from cryptography.hazmat.primitives.serialization import Encoding
from typer import Option

from accept.base.child_processes import process_pool
from accept.base.console import operator_name, say, tell
from accept.base.exit_codes import Exit
from accept.base.home import home
from accept.base.progress import steps
from accept.batch import judge_batch
from accept.batch.judge_batch import CERTIFICATES, BatchRequest
from accept.batch.table import reasons, simulated, units_table
from accept.certificate import is_valid_demo, ready
from accept.commands.answer import Answer, Remark, command
from accept.commands.options import Operator
from accept.commands.trust.bench_keys import DEMO, demo_credential
from accept.fleet import learn, lines, measured_units, shifts, write_population
from accept.gap import beside_truth
from accept.judging import load_spec
from accept.models.model_file import open_model_file
from accept.simulate import published_units, write
from accept.simulate.demo import MODEL, demo_strut, earlier_struts
from accept.simulate.unit import TRUTH_FILE, SimulatedUnit
from accept.store import open_store

LEARNED = "batch.toml"  # the model file of the struts' batch
SHOWN = 3  # values that the batch taught most about


@command
def run(
    out: Annotated[Path, Option(help="Folder for the results.")] = Path("accept-demo"), operator: Operator = None
) -> Answer:
    """Run the whole job on built-in data. Judge seven published APAs and a simulated strut, certify, verify."""
    began = time.monotonic()
    place = home() / DEMO
    with process_pool(1) as elsewhere:
        elsewhere.submit(ready)  # it starts while the units are made
        credential = demo_credential(home())
        units = [*published_units.write_units(out / "units"), _write(demo_strut(), out / "units")]
        learned = _learn_model(out)
        specs = {"apa": load_spec("apa-basic"), "strut": load_spec("strut-basic")}
        request = BatchRequest(
            units, out, specs, operator_name(operator), credential, model=str(learned), pool=elsewhere
        )
        ca = credential.ca.public_bytes(Encoding.PEM)
        with open_store(f"sqlite:///{place / 'store.sqlite'}") as store:
            report = judge_batch.run(request, store, say)
        files = {u.serial: out / str(u.certificate) for u in report.units}
        pending = [elsewhere.submit(is_valid_demo, files[u.serial], ca) for u in report.units if u.kind == "apa"]
        valid = [is_valid_demo(files[u.serial], ca) for u in report.units if u.kind == "strut"]
        valid += [answer.result() for answer in steps(pending, "certificates verified")]
    apas, struts = ([u for u in report.units if u.kind == kind] for kind in ("apa", "strut"))
    # [STB] table 2.1, of an optimiser that stopped early; the exact minimum zone is judged.
    published = {apa.serial: f"{apa.published_flatness_um:g}" for apa in published_units.SEED_APAS}
    effects = json.loads((units[-1] / TRUTH_FILE).read_text())["effects"]  # read only after the analysis
    truth = {e["name"]: {k: v for k, v in e.items() if k != "name"} for e in effects}
    named = [[n["effect"] for n in (strut.gap or {}).get("named", [])] for strut in struts]
    return Answer(
        units_table(apas, {"published\nflatness um": published}),
        units_table(struts),
        *simulated(report.units),
        *reasons(report.units),
        Remark(f"certificates: {sum(valid)} of {len(valid)} verified, in {out / CERTIFICATES}"),
        Remark(f"results: {out / 'results.json'}, results.csv, junit.xml ({time.monotonic() - began:.1f} s)"),
        *(f"{strut.serial}: {beside_truth(strut.gap or {}, truth)}" for strut in struts),
        exit=Exit.ACCEPTED if all(valid) and named == [list(truth)] else Exit.REJECTED,
    )


def _write(unit: SimulatedUnit, folder: Path) -> Path:
    return write(unit, folder / unit.serial)


def _learn_model(out: Path) -> Path:
    """Learn a model from earlier struts of the same batch, print what was learned, and return its file."""
    given, path = open_model_file(MODEL), out / LEARNED
    earlier = [_write(strut, out / "batch") for strut in earlier_struts()]
    found = learn(measured_units(earlier, given), given, lambda _: None)
    write_population(path, found)
    tell(f"{lines(found)[0]} ({path})", *(f"  {line}" for line in shifts(found, SHOWN)))
    return path
