"""gap.html: the report to zoom in. One file that opens without a network."""

from collections.abc import Sequence

from accept.gap.empirical import AddedElement, elements_of
from accept.gap.report_tables import tables
from accept.gap.summary import result_lines
from accept.gap.text import headline_of_result
from accept.pictures.interactive import page
from checks.gap import Result, bode_panels


def render_html(serial: str, result: Result, added: Sequence[AddedElement] = ()) -> bytes:
    """Return the page. Raises PictureError if plotly is not installed."""
    return page(
        bode_panels(result, elements_of(added)),
        f"{serial}: {headline_of_result(result)}",
        [f"Model {result.model}, damping {result.damping}.", *(words for words, _ in result_lines(result))],
        list(tables(result, added).values()),
    )
