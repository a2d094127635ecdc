"""Rules of the project, checked as tests: linters, folders, commit titles, line budgets."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TOOLS = Path(sys.executable).parent
PORTIONS = ("cli", "gui", "analysis", "virtual_rig", "acquisition", "sim")
LINES_AT_MOST = {
    "acquisition": 26_560,
    "analysis": 32_644,
    "cli": 4_875,
    "extensions": 3_354,
    "gui": 11_764,
    "native": 6_874,
    "sim": 20_648,
    "studies": 2_920,
    "virtual_rig": 6_503,
}
"""Lines of Python, stubs, templates and C++, without the C++ test program; their sum only decreases."""

TITLES_CHECKED_SINCE = "fa33b4fc66a96ac303cdf07b2454bceed13e319a"
IMPERATIVES = {"Bring", "Embed", "Exceed", "Feed", "Focus", "Need", "Proceed", "Ring", "Speed", "String"}
"""Imperatives that end like a participle or a third person."""
NO_VERBS = {"A", "An", "Each", "Every", "If", "It", "No", "The", "There", "What", "Where", "Who"}


@pytest.mark.timeout(300)  # mypy without a cache, together with another test, on two cores
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["ruff", "check", "."], id="lint"),
        pytest.param(["ruff", "format", "--check", "."], id="format"),
        pytest.param(["mypy"], id="types", marks=pytest.mark.thorough),  # a minute without a cache
        pytest.param(["lint-imports", "--no-cache"], id="imports-point-one-way"),
    ],
)
def test_the_checks_of_linter_formatter_types_and_imports_pass(command):
    result = subprocess.run(
        [str(TOOLS / command[0]), *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, f"{' '.join(command)}\n{result.stdout}{result.stderr}"


@pytest.mark.parametrize("portion", PORTIONS)
def test_each_namespace_package_is_imported_from_its_own_folder(portion):
    package = importlib.import_module(f"vibench.{portion}")
    assert Path(package.__file__).parent == ROOT / portion / "vibench" / portion
    assert (Path(package.__file__).parent / "py.typed").is_file()
    assert not (ROOT / portion / "vibench" / "__init__.py").exists()  # it would hide the other portions


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is a copy, not a checkout")
def test_git_tracks_no_generated_file():
    """Results in a checkout would change the file names of a new user's first demo."""
    command = ["git", "ls-files", "--cached", "--ignored", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert listed.stdout.splitlines() == []


def commits_since(commit):
    """Return the titles of later commits, or None without that history (a copy, or a shallow clone)."""
    log = subprocess.run(
        ["git", "log", "--no-merges", "--format=%s", f"{commit}..HEAD"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return log.stdout.splitlines() if log.returncode == 0 else None


def title_fault(title):
    """Return what is wrong with the title of a commit, or an empty text."""
    first = title.split(" ")[0]
    if len(title) > 60:
        return f"{len(title)} characters; at most 60 are allowed"
    if not first.replace("-", "").isalpha() or not first[0].isupper():
        return "must begin with a capital letter"
    is_inflected = re.fullmatch(r".*(ed|ing|[^s]s)", first) and first not in IMPERATIVES
    if is_inflected or first in NO_VERBS:
        return "must begin with a verb in the imperative"
    return "must not end with a full stop" if title.endswith(".") else ""


def test_commit_titles_are_short_imperatives():
    titles = commits_since(TITLES_CHECKED_SINCE)
    if titles is None:
        pytest.skip("this is a copy or a shallow clone: there is no history to check")
    assert {title: fault for title in titles if (fault := title_fault(title))} == {}


@pytest.mark.parametrize(
    ("title", "is_allowed"),
    [
        ("Align channels by start time", True),
        ("Embed the plan in the recording", True),
        ("Aligned channels by start time", False),
        ("Aligns channels by start time", False),
        ("What rings of a fast sweep is counted by its test", False),
        ("align channels", False),
        ("Align channels.", False),
        ("Align the channels of an imported file by the times at which they start", False),
    ],
)
def test_the_commit_title_check_recognises_imperatives(title, is_allowed):
    assert (title_fault(title) == "") is is_allowed


@pytest.mark.parametrize("folder", sorted(LINES_AT_MOST))
def test_a_package_stays_within_its_line_budget(folder):
    sources = [
        path
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".py", ".pyi", ".j2", ".hpp", ".cpp"} and path.name != "test_engine.cpp"
    ]
    lines = sum(path.read_text(encoding="utf-8").count("\n") for path in sources)
    assert 0 < lines <= LINES_AT_MOST[folder]
    assert sum(LINES_AT_MOST.values()) <= 116_142
