"""Installation: version, shipped files, `vibench doctor`, shell completion, missing libraries, size."""

import json
import os
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.full_disk import full_disk
from vibench.acquisition import shipped_folder
from vibench.acquisition.host.installation import EXTRAS
from vibench.cli.__main__ import COMMANDS
from vibench.cli.doctor import VARIABLES, libraries
from vibench.cli.output import ExitCode

ROOT = Path(__file__).resolve().parents[2]
PORTIONS = ("acquisition", "analysis", "cli", "gui", "sim", "virtual_rig")

WITHOUT = """
import sys
for library in {libraries!r}:
    sys.modules[library] = None
sys.argv = ["vibench", *{arguments!r}]
from vibench.cli import main
main()
"""
ONE_AFTER_ANOTHER = """
import contextlib, io, json, sys
for library in {libraries!r}:
    sys.modules[library] = None
from vibench.cli import main
told = []
for words in {lines!r}:
    sys.argv, out, err = ["vibench", *words], io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as ended:
        told.append((ended.code or 0, out.getvalue(), err.getvalue()))
print(json.dumps(told))
"""


def run_vibench(program, cwd):
    environment = {**os.environ, "COLUMNS": "200"}
    return subprocess.run(
        [sys.executable, "-c", program], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


def run_without(libraries, *arguments, cwd):
    """Run ``vibench`` while some libraries cannot be imported."""
    return run_vibench(WITHOUT.format(libraries=libraries, arguments=tuple(map(str, arguments))), cwd)


def test_the_version_matches_the_package(output_of):
    assert output_of("--version") == f"vibench {version('vibench')}\n"


def test_a_shipped_study_is_planned_by_name_from_an_empty_folder(output_of, tmp_path):
    assert output_of("study", "paper", "--out", "out.h5", "--estimate", "--json")["points"] == 17730
    assert not (tmp_path / "out.h5").exists()


def test_copies_of_shipped_files_are_complete_and_never_overwrite_a_file(output_of, refusal, tmp_path):
    output_of("examples", "--copy", "mine")
    for folder in ("campaigns", "hardware_configs", "studies", "examples"):
        for path in shipped_folder(folder).rglob("*.toml"):
            copy = tmp_path / "mine" / folder / path.relative_to(shipped_folder(folder))
            assert copy.read_bytes() == path.read_bytes()
    changed = tmp_path / "mine" / "campaigns" / "quick.toml"
    changed.write_text("changed", encoding="utf-8")
    assert "exists already; nothing was copied" in refusal("examples", "--copy", "mine")
    assert changed.read_text(encoding="utf-8") == "changed"


def test_every_shipped_example_has_a_unique_name(output_of):
    for line in output_of("examples").splitlines()[:-1]:
        names = line.partition(": ")[2].split(", ")
        assert len(names) == len(set(names)), line


def test_shipped_studies_are_listed_as_toml_files(output_of):
    listed = output_of("examples", "--json")["studies"]
    assert {Path(each).suffix for each in listed} == {".toml"}


def test_a_full_disk_is_reported_in_one_sentence(refusal):
    with full_disk(room_bytes=100):
        said = refusal("examples", "--copy", "mine")
    with full_disk(room_bytes=17_000):
        copied = refusal("docs", "--out", "site")
    assert re.search(r"mine cannot be created as a folder: .* cannot be written to \(File too large\)", said)
    assert re.search(r"there is no space for .*docs/.*; data written so far are kept", copied)


@pytest.mark.thorough
def test_the_doctor_shows_versions_and_folders_and_permissions_but_no_secrets(vibench_here, tmp_path):
    environment = {"VIBENCH_RIG_TOKEN": "do-not-tell", "VIBENCH_STATE_DIR": str(tmp_path / "state")}
    told = vibench_here("doctor", "--json", cwd=tmp_path, environment=environment)
    sections = json.loads(told.stdout)
    assert sections["libraries"]["numpy"] == version("numpy")
    assert sections["engine"]["self-test"] == "passed"
    assert Path(sections["engine"]["library"]).is_file()
    assert sections["folders"]["state"].startswith(f"{tmp_path / 'state'}, writable, ")
    assert sections["environment"]["VIBENCH_RIG_TOKEN"] == "(set, secret)"
    assert "do-not-tell" not in told.stdout
    assert vibench_here("doctor", cwd=tmp_path).stdout.startswith("vibench:\n  version: ")


@pytest.mark.thorough
@pytest.mark.parametrize("state", ["file", "file/below"])
def test_the_doctor_reports_an_unwritable_state_folder_but_predictions_work(vibench_here, tmp_path, state):
    (tmp_path / "file").write_text("a file in the way")
    environment = {"VIBENCH_STATE_DIR": str(tmp_path / state)}
    told = vibench_here("doctor", "--json", cwd=tmp_path, environment=environment)
    assert json.loads(told.stdout)["folders"]["state"].startswith(f"{tmp_path / state}, NOT writable, ")
    predicted = vibench_here(
        "predict", "--amplitude", "1e-6", "--frequency", "100", cwd=tmp_path, environment=environment
    )
    assert predicted.returncode == 0, predicted.stderr


def test_the_doctor_names_the_smallest_extra_that_contains_a_missing_library(monkeypatch):
    def missing(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr("vibench.cli.doctor.version", missing)
    found = dict(libraries())
    assert found["matplotlib"] == "not installed (extra figures)"
    assert found["pyvisa"] == "not installed (extra bench)"
    assert found["numpy"] == "not installed"


@pytest.mark.parametrize(
    ("words", "completed"),
    [("vibench predict --ampl", "--amplitude"), ("vibench bench ch", "check")],
)
def test_a_shell_completes_commands_and_their_options(vibench, tmp_path, words, completed):
    asked = {"_VIBENCH_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    program = [
        sys.executable,
        "-c",
        "import sys; sys.argv[0] = 'vibench'; from vibench.cli import main; main()",
    ]
    told = subprocess.run(program, env={**os.environ, **asked}, capture_output=True, text=True, check=False)
    assert completed in told.stdout.split()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("library", "arguments", "extra"),
    [
        ("pyvisa", ("bench", "list"), "bench"),
        ("nidaqmx", ("measure", "quick", "--out", "out"), "bench"),
        ("grpc", ("serve-rig",), "bench"),
        ("PySide6", ("gui",), "gui"),
        ("pyqtgraph", ("gui",), "gui"),
        ("matplotlib", ("analyse", "some.h5", "--out", "out"), "figures"),
        (
            "matplotlib",
            ("branches", "--frequency", 60, "--amplitude", "1e-6:2e-6", "--out", "out"),
            "figures",
        ),
        ("matplotlib", ("map", "basin", "--out", "out"), "figures"),
        ("matplotlib", ("reproduce", "--out", "out"), "figures"),
    ],
)
def test_a_missing_library_is_reported_with_the_install_command(tmp_path, library, arguments, extra):
    told = run_without([library], *arguments, cwd=tmp_path)
    assert told.returncode == 1
    assert told.stderr.startswith(f"error: {library}")
    assert f"pip install 'vibench[{extra}]'" in told.stderr
    assert "Traceback" not in told.stderr
    assert not (tmp_path / "out").exists()


INSTRUMENTS_AND_WINDOW = [*EXTRAS["bench"], *EXTRAS["gui"]]


CORE_ALONE = [
    ("predict", "--model", "linear", "--amplitude", "1e-6", "--frequency", "95", "--json"),
    ("study", "paper", "--out", "out.h5", "--estimate", "--json"),
    ("doctor", "--json"),
    ("specimen", "asymmetric", "--json"),
]


@pytest.mark.thorough
def test_the_base_installation_shows_all_help_and_runs_all_commands_without_figures(tmp_path):
    helps = [(*words, "--help") for words in (*((name,) for name in COMMANDS), ("bench", "list"))]
    program = ONE_AFTER_ANOTHER.format(
        libraries=[*INSTRUMENTS_AND_WINDOW, *EXTRAS["figures"]], lines=[*CORE_ALONE, *helps]
    )
    done = run_vibench(program, tmp_path)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [(code, said) for code, _, said in told if code] == []
    for words, (_, shown, _) in zip([*CORE_ALONE, *helps], told, strict=True):
        if words in CORE_ALONE:
            assert json.loads(shown), words
        else:
            assert f"vibench {' '.join(words[:-1])}" in shown


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("missing", "extra"), [(EXTRAS["bench"], "bench"), (EXTRAS["figures"], "figures"), (None, "bench")]
)
def test_the_demo_names_the_missing_extra_before_it_begins(tmp_path, missing, extra):
    left_out = [*INSTRUMENTS_AND_WINDOW, *EXTRAS["figures"]] if missing is None else missing
    told = run_without(left_out, "demo", cwd=tmp_path)
    assert (told.returncode, told.stdout) == (1, "")
    assert f"pip install 'vibench[{extra}]'" in told.stderr
    assert not (tmp_path / "vibench_demo").exists()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("left_out", "imported"),
    [
        (INSTRUMENTS_AND_WINDOW, "from vibench.analysis.report import result_figures"),
        ([*INSTRUMENTS_AND_WINDOW, *EXTRAS["figures"]], "from vibench.sim.maps import solve_map"),
    ],
)
def test_plans_and_recordings_and_analysis_need_neither_instruments_nor_the_window(left_out, imported):
    program = (
        f"import sys\nfor library in {left_out!r}: sys.modules[library] = None\n"
        "from vibench.acquisition import load_campaign, open_recording, run_campaign\n"
        f"from vibench.analysis import analyse, analyse_files\n{imported}\n"
        "print(load_campaign('paper').name)"
    )
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert told.stdout == "paper\n", told.stderr


def installed_mb(name, seen):
    """Return the size of a library and of its dependencies, each counted once [MB]."""
    if name in seen:
        return 0.0
    seen.add(name)
    found = distribution(name)
    paths = [Path(str(found.locate_file(each))) for each in found.files or ()]
    size = sum(path.stat().st_size for path in paths if path.is_file()) / 1e6
    needed = [Requirement(text) for text in found.requires or ()]
    return size + sum(
        installed_mb(canonicalize_name(each.name), seen)
        for each in needed
        if each.marker is None or each.marker.evaluate({"extra": ""})
    )


def test_the_core_installation_takes_less_than_300_megabytes():
    assert 200 < installed_mb("vibench", set()) < 300


def test_the_installation_page_lists_exit_codes_and_environment_variables():
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert [int(each) for each in re.findall(r"^\| (\d) \|", page, flags=re.M)] == list(ExitCode)
    assert dict(re.findall(r"^\| `([A-Z_]+)` \| (.+) \|$", page, flags=re.M)) == {
        name: told.replace("'offscreen'", "`offscreen`") for name, told in VARIABLES.items()
    }


def test_environment_variables_in_the_sources_are_on_the_installation_page():
    read = r"""(?:environ(?:\.get|\.setdefault)?[\[(]|VARIABLE = )["']([A-Z][A-Z_]+)["']"""
    sources = [path for portion in PORTIONS for path in (ROOT / portion).rglob("*.py")]
    found = {name for path in sources for name in re.findall(read, path.read_text(encoding="utf-8"))}
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    assert {"VIBENCH_STATE_DIR", "VIBENCH_SEAL_KEY", "OPENBLAS_NUM_THREADS"} <= found
    assert [name for name in sorted(found) if f"`{name}`" not in page] == []
