"""gap.html: the report to zoom in. One file that opens without a network."""

from collections.abc import Sequence

from accept.gap.improved_model import AddedElement, elements_of
from accept.gap.report import report, title
from accept.pictures.blocks import Heading, Sentence, Table
from accept.pictures.interactive import page
from checks.gap import Result, bode_panels


def render_html(serial: str, result: Result, added: Sequence[AddedElement] = ()) -> bytes:
    """Return the page. Raises PictureError if plotly is not installed."""
    words, tables = [f"Model {result.model}, damping {result.damping}."], []
    for block in report(result, added):
        match block:
            case Heading():
                words.append(block.words)
            case Sentence():
                words += [block.words, *filter(None, [block.more])]
            case Table():
                tables.append(block)
    return page(bode_panels(result, elements_of(added)), title(serial, result), words, tables)
