"""Options of the contract tests, defined by an entry point because ``--pyargs`` loads a conftest too late."""

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for the instrument and its bench, under names that no other project uses."""
    group = parser.getgroup("vibench", "the instrument that vibench.acquisition.contract tests")
    group.addoption("--vibench-instrument", help="name of the entry point, as in a bench file")
    group.addoption("--vibench-bench", help="bench file that names this instrument; default: a shipped one")
