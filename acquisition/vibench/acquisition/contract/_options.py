"""The options of the contract tests; pytest loads this module by its entry point, since no conftest can add
options to ``--pyargs``.
"""

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Ask for the instrument and its bench, by names that no other project defines."""
    group = parser.getgroup("vibench", "an instrument of vibench, for vibench.acquisition.contract")
    group.addoption("--vibench-instrument", help="name of its entry point, as in a bench file")
    group.addoption("--vibench-bench", help="bench file that uses it; default: a shipped virtual bench")
