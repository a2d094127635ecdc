"""One thread for linear algebra, as for the command; and the window's tests wherever Qt can be loaded."""

import os
import tempfile

import pytest

import vibench.cli.blas_threads  # noqa: F401 - it is the import that counts, before any test imports numpy

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("QT_SCALE_FACTOR", "1")
os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")

# Tests keep their bench checks apart from those of whoever runs them; processes they start inherit it.
_state_folder = tempfile.TemporaryDirectory(prefix="vibench_state_")
os.environ["VIBENCH_STATE_DIR"] = _state_folder.name

# pytest-qt ends the whole run where Qt's system libraries are missing, so it is loaded here, after a look.
QT_MISSING = ""
try:
    from PySide6 import QtGui, QtTest, QtWidgets  # noqa: F401 - to see whether they load
except ImportError as error:
    if os.environ.get("REQUIRE_GUI") == "1":
        raise
    QT_MISSING = str(error)
    collect_ignore_glob = ["gui/*"]
else:
    pytest_plugins = ["pytestqt.plugin"]


def pytest_report_header() -> str:
    """Say aloud when the window is not tested: a green run must not hide it."""
    if QT_MISSING:
        return (
            f"the window's tests were NOT RUN: Qt cannot be loaded ({QT_MISSING}); docs/gui.md names packages"
        )
    return "the window is tested offscreen"


LONGEST = (
    "tests/cli/test_demo.py",
    "tests/sim/chain/test_integrate.py",
    "tests/sim/exponents/test_lyapunov_spectrum.py",
    "tests/sim/exponents/test_tangent.py",
    "tests/cli/test_killed_campaign.py",
    "tests/gui/pages/compare/test_compare_page.py",
)
"""Files of few and long tests: begun last, one would run while the other process has nothing to do."""


def pytest_configure(config: pytest.Config) -> None:
    """Let files be handed out in the order below, not by their number of tests."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest."""
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(place)))
