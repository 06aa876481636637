"""The fixture of the statements, and what a test's call came to, for its teardown."""

from collections.abc import Generator

import pytest

from tests.statements.case import case

__all__ = ["case"]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.when == "call":
        item.called = report  # type: ignore[attr-defined]
    return report
