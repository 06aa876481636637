"""Records that fit not their unit's product but a variant of it, such as a strut without encoder."""

from collections.abc import Callable

from checks.cause import Cause, because
from checks.declare import CsvTable, Series
from checks.errors import RecordError
from checks.record import Record
from specs.plugins import products


def pointed_to_variant(
    error: RecordError, kind: str, declared: Series | CsvTable, read: Callable[[Series], Record]
) -> RecordError:
    """Return why a record was refused, with the variant of its product that it fits, if any. read: reads the file as
    declared, or raises RecordError."""
    for product in products().values():
        lost = isinstance(declared, Series) and declared.channels.keys() & product.absent.keys()
        if product.variant_of != kind or not isinstance(declared, Series) or not lost:
            continue
        try:
            read(declared.without(product.absent))
        except RecordError:
            continue
        title = f"{product.title[0].lower()}{product.title[1:]}"
        return RecordError(because(Cause.OTHER_VARIANT, detail=str(error.reason), title=title, kind=product.name))
    return error
