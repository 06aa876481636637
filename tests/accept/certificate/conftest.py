"""The certificate that most tests of verification read, in its three states."""

import pytest

from tests.accept.certificate.verify.verify_help import Bench, made_bench


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Not to be changed: a test takes copies of what it changes."""
    return made_bench(tmp_path_factory.mktemp("unit"))
