"""`accept product`: what can be judged here, and how another product is added."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from accept.base.atomic_files import write_atomic
from accept.base.documents.listings import ProductList, ProductListed
from accept.base.exit_codes import Exit
from accept.commands.answer import Answer, File, Remark, command, table
from accept.commands.options import JsonAnswer
from specs import plugins
from specs.plugins import BUILT_IN, ProductError, product_named, products
from specs.products import Product

OWN = "built-in"


@command
def show_list(json: JsonAnswer = None) -> Answer:
    """List the installed products. With spec, model and the package that brings each."""
    listed = [
        ProductListed(
            product.name, product.title, str(product.spec), None if product.model is None else str(product.model),
            tuple(product.parts), _package(product),
        )
        for product in products().values()
    ]  # fmt: skip
    rows = ((one.name, one.title, one.spec, one.model or "-", one.package) for one in listed)
    return Answer(File(json, ProductList(tuple(listed))), table(("name", "title", "spec", "model", "from"), rows))


def _package(product: Product) -> str:
    found = next((p for p in plugins.USED if p.value is product), None)
    return OWN if product.name in BUILT_IN or found is None else f"{found.package} {found.version}"


@command
def new(
    name: Annotated[str, Argument(help="Its name: `kind` in unit.toml and in specs.")],
    out: Annotated[Path | None, Option(help="Folder to write; default: ./accept-product-NAME.")] = None,
) -> Answer:
    """Write the package of a new product, to be installed. With a spec, a check of its own and an example unit."""
    from accept.units.product_package import skeleton

    folder = out if out is not None else Path(f"accept-product-{name}")
    files = skeleton(name)
    if folder.exists() and any(folder.iterdir()):
        raise ProductError(f"{folder}: is there already and not empty; name another folder with --out")
    for file, text in files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        write_atomic(folder / file, text.encode("utf-8"))
    written = (str(folder / file) for file in files)
    return Answer(*written, Remark(f"next: accept product check {folder}; pip install -e {folder}"))


@command
def check(product: Annotated[str, Argument(help="Name of an installed product, or its folder.")]) -> Answer:
    """Check a product, installed or in its folder. Reads its spec, checks and model; the code in a folder is run."""
    from accept.units.product_package import from_folder

    folder = Path(product)
    if product not in products() and folder.is_dir():
        with from_folder(folder) as found:
            return _check(found)
    return _check(product_named(product))


def _check(product: Product) -> Answer:
    from accept.judging import load_spec
    from accept.models.model_file import open_model
    from checks.acceptance import CHECKS

    spec = load_spec(str(product.spec))
    problems = []
    if spec.kind != product.name:
        problems.append(f"its spec {product.spec} judges '{spec.kind}'")
    problems += [f"checks: no check is called '{name}'" for name in product.checks if name not in CHECKS]
    if product.model is not None:
        open_model(product.model)
    elif spec.gap is not None:
        open_model(spec.gap.model)
    quantities = {q for name in spec.checks for q in CHECKS[name].quantities}
    problems += [f"matched_by: its checks measure no '{name}'" for name in product.matched_by if name not in quantities]
    if problems:
        words = (Remark(f"accept: product '{product.name}': {problem}") for problem in problems)
        return Answer(*words, exit=Exit.BAD_INPUT)
    required = [name for name, asked in spec.checks.items() if asked.required]
    model = "no model" if product.model is None else f"model {product.model}"
    return Answer(f"{product.name}: valid; spec {spec.name} ({', '.join(required)} required), {model}")
