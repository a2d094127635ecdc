"""The wheel as users install it, also beside user files that are named like our folders."""

import json
import os
import platform
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PORTIONS = ("acquisition", "analysis", "cli", "gui", "sim", "virtual_rig")

FACES = """
from vibench.acquisition import open_bench, open_recording, run_campaign
from vibench.analysis import transmissibility
from vibench.sim import Harmonic, gong2025, lyapunov_exponent, periodic_branch, steady_response
"""
EVERY_NAME = """
import importlib, pkgutil
for portion in {portions}:
    package = importlib.import_module(f"vibench.{{portion}}")
    rooms = [room.name for room in pkgutil.iter_modules(package.__path__) if room.ispkg]
    for face in (package, *(importlib.import_module(f"vibench.{{portion}}.{{room}}") for room in rooms)):
        for name in getattr(face, "__all__", ()):
            getattr(face, name)
print("every name resolves")
"""


def run(*command, cwd, **environment):
    """Run a program outside this checkout, and return its standard output."""
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    result = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=kept | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, f"{command}\n{result.stdout}{result.stderr}"
    return result.stdout


def pip(*arguments):
    return run(sys.executable, "-m", "pip", "--quiet", *arguments, cwd=ROOT)


def empty_environment(folder):
    """Create an environment without packages, and return its interpreter."""
    venv.create(folder, symlinks=os.name != "nt")
    programs = Path(sysconfig.get_path("scripts", "venv", {"base": str(folder), "platbase": str(folder)}))
    return programs / Path(sys.executable).name


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT)
    (built,) = folder.glob("vibench-*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory):
    """Interpreter of an environment that contains the wheel and the libraries of these tests."""
    folder = tmp_path_factory.mktemp("installed")
    python = empty_environment(folder)
    pip("--python", python, "install", "--no-deps", "--no-compile", wheel)
    site = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder), "platbase": str(folder)}))
    # The .pth file adds the libraries of these tests to the path, but not the .pth files of this checkout.
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    return python


@pytest.fixture
def users_folder(tmp_path):
    for portion in PORTIONS:
        (tmp_path / f"{portion}.py").write_text("raise RuntimeError('a file of the user was imported')\n")
    return tmp_path


@pytest.mark.thorough
def test_the_wheel_contains_types_and_templates_and_shipped_files(wheel):
    names = set(ZipFile(wheel).namelist())
    for portion in PORTIONS:
        assert f"vibench/{portion}/py.typed" in names
        assert f"vibench/{portion}/__init__.pyi" in names
    assert "vibench/__init__.py" not in names
    assert any(name.endswith("/report.html.j2") for name in names)
    for folder in ("hardware_configs", "campaigns", "studies"):
        for path in (ROOT / folder).rglob("*.toml"):
            inside = path.relative_to(ROOT).as_posix()
            assert f"vibench/shipped/{inside}" in names
    assert "vibench/shipped/examples/response_and_exponent.py" in names
    for path in (ROOT / "studies" / "paper").glob("*.py"):
        assert f"vibench/shipped/studies/paper/{path.name}" in names


@pytest.mark.thorough
def test_the_wheel_contains_every_source_file_at_its_import_path(wheel):
    names = {
        name
        for name in ZipFile(wheel).namelist()
        if name.startswith("vibench/") and not name.startswith("vibench/shipped/")
    }
    tracked = {
        path.relative_to(ROOT / portion).as_posix()
        for portion in PORTIONS
        for path in (ROOT / portion / "vibench").rglob("*")
        if path.is_file() and not {"__pycache__", "libraries"} & set(path.parts)
    }
    libraries = {name for name in names if "/engine/libraries/" in name}
    assert len(libraries) == (1 if platform.machine() in {"arm64", "aarch64"} else 3)
    assert names - libraries == tracked


@pytest.mark.thorough
def test_a_script_imports_vibench_even_beside_local_files_named_like_its_folders(python, users_folder):
    script = users_folder / "script.py"
    script.write_text(f"{FACES}\nimport vibench.sim\nprint(vibench.sim.__file__)\n")
    imported = Path(run(python, script, cwd=users_folder).strip())
    assert imported.is_relative_to(python.parent.parent)


@pytest.mark.thorough
def test_every_name_of_every_public_api_resolves_from_the_wheel(python, users_folder):
    printed = run(
        python, "-c", EVERY_NAME.format(portions=PORTIONS), cwd=users_folder, QT_QPA_PLATFORM="offscreen"
    )
    assert printed == "every name resolves\n"


@pytest.mark.thorough
def test_the_vibench_command_works_as_a_module_and_as_a_program(python, users_folder):
    assert "predict" in run(python, "-m", "vibench.cli", "--help", cwd=users_folder)
    command = python.parent / ("vibench.exe" if sys.platform == "win32" else "vibench")
    arguments = ("predict", "--model", "linear", "--amplitude", "1e-6", "--frequency", "95", "--json")
    (point,) = json.loads(run(command, *arguments, cwd=users_folder))["points"]
    assert point["relative_i"] > 0
    run(command, "figure", "1", "--out", "figures", cwd=users_folder)
    assert (users_folder / "figures" / "figure_1c.png").is_file()


@pytest.mark.slow
@pytest.mark.timeout(900)  # an installation compiles all its kernels at first use
def test_a_shipped_campaign_is_measured_and_analysed_from_the_wheel(python, users_folder):
    run(python, "-m", "vibench.cli", "measure", "quick", "--out", "recordings", cwd=users_folder)
    run(python, "-m", "vibench.cli", "analyse", "recordings/noise.h5", "--out", "analysed", cwd=users_folder)
    assert list((users_folder / "analysed").rglob("*.html"))


def lowest_versions():
    """Yield each requirement at the lowest version that pyproject.toml allows."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    for text in (*project["dependencies"], *extras["bench"], *extras["gui"]):
        requirement = Requirement(text)
        if requirement.name == "vibench" or (requirement.marker and not requirement.marker.evaluate()):
            continue
        (lowest,) = (part.version for part in requirement.specifier if part.operator in {">=", "=="})
        extras = f"[{','.join(sorted(requirement.extras))}]" if requirement.extras else ""
        yield f"{requirement.name}{extras}=={lowest}"


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_vibench_works_with_the_lowest_allowed_version_of_every_required_library(
    wheel, tmp_path, users_folder
):
    """docs/decisions/0005-dependencies.md gives the reason for each lower bound."""
    python = empty_environment(tmp_path / "lowest")
    pip("--python", python, "install", "--prefer-binary", wheel, *lowest_versions())
    run(python, "-c", EVERY_NAME.format(portions=PORTIONS), cwd=users_folder, QT_QPA_PLATFORM="offscreen")
    assert "predict" in run(python, "-m", "vibench.cli", "--help", cwd=users_folder)
    arguments = ("predict", "--model", "hertz", "--amplitude", "5e-6", "--frequency", "260", "--json")
    (point,) = json.loads(run(python, "-m", "vibench.cli", *arguments, cwd=users_folder))["points"]
    assert point["impacts"] > 0
    # The virtual rig uses every library of the bench: VISA, USB, DAQmx, gRPC.
    run(python, "-m", "vibench.cli", "measure", "quick", "--out", "recordings", cwd=users_folder)
    run(python, "-m", "vibench.cli", "analyse", "recordings/noise.h5", "--out", "analysed", cwd=users_folder)
