"""What tests ask of a result that is none: its causes, not its words."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from checks.cause import Cause, NoResult, Reason
from checks.quantity import Quantity


def causes(found: Quantity | Reason | None) -> set[Cause]:
    """Every cause of a quantity without a value, or of one that must not pass."""
    reason = found.reason or found.doubt if isinstance(found, Quantity) else found
    return set() if reason is None else {r.cause for r in reason.all()}


@contextmanager
def no_result(cause: Cause, **parameters: object) -> Iterator[None]:
    """The block raises NoResult of this cause, with at least these parameters, record and file among them."""
    with pytest.raises(NoResult) as refused:
        yield
    reason = next((r for r in refused.value.reason.all() if r.cause is cause), None)
    assert reason is not None, str(refused.value)
    known = {**reason.parameters, "record": reason.record, "file": reason.file}
    assert {k: known.get(k) for k in parameters} == parameters
