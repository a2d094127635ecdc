"""The options of the contract tests; pytest loads this module by its entry point, since no conftest can add
options to ``--pyargs``.
"""

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Ask for the instrument and its bench."""
    group = parser.getgroup("vibench", "an instrument of vibench, for vibench.acquisition.contract")
    group.addoption("--instrument", help="name of its entry point, as a hardware configuration gives it")
    group.addoption("--bench", help="hardware configuration that names it; else a shipped virtual one")
