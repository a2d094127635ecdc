"""Other packages import only public APIs; modules behind a public API are private to its package."""

import ast
import doctest
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PORTIONS = ("sim", "acquisition", "virtual_rig", "analysis", "gui", "cli")
FOR_PEOPLE = (
    "vibench.sim",
    "vibench.sim.study",
    "vibench.sim.maps",
    "vibench.sim.branches",
    "vibench.sim.chain",
    "vibench.virtual_rig",
    "vibench.acquisition",
    "vibench.acquisition.plan",
    "vibench.acquisition.rig",
    "vibench.acquisition.instruments",
    "vibench.acquisition.recording",
    "vibench.acquisition.campaign",
    "vibench.acquisition.engine",
    "vibench.analysis",
    "vibench.analysis.live",
    "vibench.analysis.report",
    "vibench.analysis.dynamics",
    "vibench.analysis.hidden_motion",
    "vibench.analysis.exchange",
)
FOR_OUR_PROGRAMS = (
    "vibench.acquisition.control",
    "vibench.acquisition.first_day",
    "vibench.sim.engine",
    "vibench.sim.shaker",
    "vibench.sim.background",
    "vibench.sim.hdf5_files",
    "vibench.sim.operating_system",
    "vibench.stop_files",
    "vibench.sim.accuracy_benchmark",
    "vibench.analysis.prediction",
)
ONE_FILE_ROOMS = (
    "accuracy_benchmark",
    "background",
    "bench",
    "command",
    "comparison",
    "engine_link",
    "errors",
    "first_day",
    "hdf5_files",
    "kinds",
    "rig",
    "signals",
    "spectra",
    "stop_files",
    "tables",
    "tones",
)


def sources():
    """Yield every source file: its portion, module name, package and path."""
    for portion in PORTIONS:
        for path in sorted((ROOT / portion / "vibench").rglob("*.py")):
            parts = path.relative_to(ROOT / portion).with_suffix("").parts
            yield (
                portion,
                ".".join(parts[:-1] if parts[-1] == "__init__" else parts),
                ".".join(parts[:-1]),
                path,
            )
    for path in sorted((ROOT / "studies" / "paper").glob("[!_]*.py")):
        yield "cli", f"vibench.cli.paper.{path.stem}", "vibench.cli.paper", path


MODULES = {name: path for _, name, _, path in sources()}


def imports_of(path, room):
    """Yield line, absolute module and names of every vibench import in a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom):
            continue
        base = room.split(".")[: len(room.split(".")) - node.level + 1] if node.level else []
        target = ".".join([*base, *([node.module] if node.module else [])])
        if target.startswith("vibench"):
            yield node.lineno, target, [each.name for each in node.names]


def api_violations(room, package, target, names):
    """Yield every private name or module that an import reaches."""
    other = ".".join(target.split(".")[:2])
    if other != package:
        if target not in FOR_PEOPLE + FOR_OUR_PROGRAMS and target.rpartition(".")[0] not in FOR_OUR_PROGRAMS:
            yield f"{target} is not a public API"
        return
    own = target == room or target.rpartition(".")[0] == room
    private = target.rpartition(".")[2].startswith("_") and not target.endswith("__main__")
    if private and not own:
        yield f"{target} is private to its room"
    yield from (
        f"{target}.{name} is private to its room"
        for name in names
        if name.startswith("_") and f"{target}.{name}" in MODULES and target != room
    )


@pytest.mark.thorough
def test_no_import_bypasses_a_public_api():
    found = [
        f"{path.relative_to(ROOT)}:{line}: {trespass}"
        for portion, _, room, path in sources()
        for line, target, names in imports_of(path, room)
        for trespass in api_violations(room, f"vibench.{portion}", target, names)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("room", "package", "target", "names"),
    [
        ("vibench.analysis.sine", "vibench.analysis", "vibench.sim.motion.integrate", ["integrate"]),
        ("vibench.analysis.sine", "vibench.analysis", "vibench.analysis.live._view", ["LiveView"]),
        ("vibench.analysis.sine", "vibench.analysis", "vibench.analysis.live", ["_view"]),
    ],
)
def test_an_import_that_bypasses_a_public_api_is_found(room, package, target, names):
    assert list(api_violations(room, package, target, names))


def test_only_modules_directly_behind_a_public_api_are_private():
    loose = [
        name
        for _, name, room, path in sources()
        if path.name != "__init__.py"
        and name.rpartition(".")[2].startswith("_") != (room in {*FOR_PEOPLE, "vibench.acquisition.drivers"})
        and not name.endswith("__main__")
        and not room.startswith("vibench.cli")  # commands are loaded by their names
        and room != "vibench.acquisition.contract"  # pytest finds tests by their names
        and name.rpartition(".")[2] not in ONE_FILE_ROOMS
    ]
    assert loose == []


def test_only_public_apis_load_their_names_on_first_use():
    stubs = {room for _, _, room, path in sources() if path.with_name("__init__.pyi").is_file()}
    assert stubs - set(FOR_PEOPLE) == {
        "vibench.cli",
        "vibench.gui",
        "vibench.acquisition.contract",  # a plug-in of pytest
        "vibench.acquisition.drivers",  # each is loaded with the library of its instrument
    }


@pytest.mark.parametrize("room", sorted({room for _, _, room, _ in sources()} - {"vibench"}))
def test_every_public_api_has_a_docstring_and_defines_its_exports(room):
    face = importlib.import_module(room)
    assert len(face.__doc__.split()) > 5
    names = getattr(face, "__all__", [])
    assert sorted(set(names)) == sorted(names)
    for name in names:
        getattr(face, name)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "face",
    [
        *FOR_PEOPLE,
        *("vibench.sim.accuracy_benchmark", "vibench.sim.shaker"),
        *("vibench.analysis.prediction", "vibench.cli.paper"),
    ],
)
def test_the_docstring_example_of_a_public_api_runs(face):
    result = doctest.testmod(importlib.import_module(face))
    assert result.attempted
    assert result.failed == 0


def modules_loaded_by(program):
    """Return the names of the modules that a new process has loaded after running a program."""
    program += "\nimport sys; print(*sorted(sys.modules))"
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.split()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("program", "heavy"),
    [
        ("import vibench.sim, vibench.sim.study, vibench.acquisition.rig", {"scipy", "h5py"}),
        ("from vibench.acquisition.plan import Measurement", {"pyvisa", "nidaqmx", "grpc"}),
        ("from vibench.acquisition.engine import EngineClient", {"pyvisa", "nidaqmx", "grpc"}),
        ("from vibench.virtual_rig import plug_in_remote", {"nidaqmx"}),
        ("import vibench.cli", {"numpy", "typer"}),
        ("import vibench.cli.measure", {"grpc", "scipy.linalg", "scipy.signal", "scipy.stats"}),
        (
            "import vibench.gui.window.window",
            {"pyvisa", "nidaqmx", "grpc", "scipy.signal", "scipy.stats"},
        ),
    ],
)
def test_importing_a_public_api_loads_no_large_library_that_it_does_not_need(program, heavy):
    assert heavy.isdisjoint(modules_loaded_by(program))
