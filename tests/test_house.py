"""The house rules, checked as tests so that one command is the whole check."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TOOLS = Path(sys.executable).parent
PORTIONS = ("cli", "gui", "analysis", "virtual_rig", "acquisition", "sim")
LINES_AT_MOST = {
    "acquisition": 28_210,
    "analysis": 31_900,
    "cli": 5_050,
    "extensions": 2_750,
    "gui": 12_610,
    "native": 6_600,
    "sim": 20_645,
    "studies": 3_220,
    "virtual_rig": 8_510,
}
"""Of Python, stubs, templates and C++, without the C++ program of tests; budgets are lowered, not raised."""


@pytest.mark.timeout(300)  # mypy without a cache, beside another test, on two cores
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["ruff", "check", "."], id="lint"),
        pytest.param(["ruff", "format", "--check", "."], id="format"),
        pytest.param(["mypy"], id="types"),
        pytest.param(["lint-imports", "--no-cache"], id="imports-point-one-way"),
    ],
)
def test_the_house_rules_hold(command):
    result = subprocess.run(
        [str(TOOLS / command[0]), *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, f"{' '.join(command)}\n{result.stdout}{result.stderr}"


@pytest.mark.parametrize("portion", PORTIONS)
def test_each_portion_of_the_namespace_comes_from_its_own_folder(portion):
    package = importlib.import_module(f"vibench.{portion}")
    assert Path(package.__file__).parent == ROOT / portion / "vibench" / portion
    assert (Path(package.__file__).parent / "py.typed").is_file()
    assert not (ROOT / portion / "vibench" / "__init__.py").exists()  # it would hide the other portions


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is a copy, not a checkout")
def test_a_checkout_contains_nothing_that_a_program_generated():
    """A folder of results in a checkout would rename the results of a newcomer's first demo."""
    command = ["git", "ls-files", "--cached", "--ignored", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert listed.stdout.splitlines() == []


@pytest.mark.parametrize("folder", sorted(LINES_AT_MOST))
def test_a_package_keeps_to_its_budget_of_lines(folder):
    sources = [
        path
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".pyi", ".j2", ".hpp", ".cpp"} and path.name != "test_engine.cpp"
    ]
    lines = sum(path.read_text(encoding="utf-8").count("\n") for path in sources)
    assert 0 < lines <= LINES_AT_MOST[folder]
