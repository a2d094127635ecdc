"""Figures of the software structure: files, lines, public APIs, imports, and call paths of three commands.

    python benchmarks/house_figures.py [--checkout DIR]

A *room* is a folder of modules, a *face* a public API. A module is *entered* when another package imports it
or a name of it; a *pair* is two rooms that import each other. A *way* is the call path of one run in the main
thread: the files and rooms with called functions, the moves from package to package, and the returns to a
package that is still on the call stack. The script also works on older checkouts without the namespace
package.
"""

import argparse
import ast
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

PORTIONS = ("sim", "acquisition", "virtual_rig", "analysis", "gui", "cli")
FOLLOWED = """
import inspect, json, os, runpy, sys
from pathlib import Path

folders = json.loads(os.environ["HOUSE_FOLDERS"])
steps, known, stack = {}, {}, []

def place_of(name):
    if name not in known:
        path = os.path.realpath(name)
        found = [(place, label) for place, label in folders.items() if path.startswith(place + os.sep)]
        known[name] = None
        if found:
            place, label = max(found, key=lambda each: len(each[0]))
            known[name] = (label, os.path.dirname(path), path)
    return known[name]

def follow(frame, event, _):
    if event == "call":
        code = frame.f_code
        is_function = code.co_flags & inspect.CO_OPTIMIZED  # bodies of modules and classes are none
        place = place_of(code.co_filename) if is_function and code.co_name != "__getattr__" else None
        here = place and (*place, code.co_qualname)
        if here is not None:
            before = next((each for each in reversed(stack) if each is not None), here)
            is_open = before[0] != here[0] and any(each and each[0] == here[0] for each in stack)
            steps[before, here, is_open] = None
        stack.append(here)
    elif event == "return" and stack:
        stack.pop()

module, *sys.argv[1:] = sys.argv[1:]
sys.argv[0] = module
try:
    sys.setprofile(follow)
    runpy.run_module(module, run_name="__main__")
except SystemExit as end:
    code = end.code
finally:
    sys.setprofile(None)
Path(os.environ["HOUSE_ANSWER"]).write_text(json.dumps([code, list(steps)]))
"""


def source_folders(checkout: Path) -> dict[str, Path]:
    """Return the folder of each package, in the namespace or at the top of an older checkout."""
    inner = {name: checkout / name / "vibench" / name for name in PORTIONS}
    found = {name: folder for name, folder in inner.items() if folder.is_dir()}
    return found or {
        name: checkout / name for name in PORTIONS if (checkout / name / "__init__.py").is_file()
    }


def modules_of(folders: dict[str, Path]) -> dict[str, Path]:
    """Return the path of every module by its dotted name."""
    return {
        ".".join((package, *_parts(path, folder))): path
        for package, folder in folders.items()
        for path in sorted(folder.rglob("*.py"))
    }


def _parts(path: Path, folder: Path) -> tuple[str, ...]:
    parts = path.relative_to(folder).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


def imports_of(name: str, path: Path, modules: dict[str, Path]) -> Iterator[str]:
    """Yield the modules of this project that a module imports, or from which it imports names."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom):
            continue
        parts = (node.module or "").split(".") if node.module else []
        if node.level:
            parts = [*package[: len(package) - node.level + 1], *parts]
        target = ".".join(parts).removeprefix("vibench.")
        for each in node.names:
            inner = f"{target}.{each.name}"
            found = inner if inner in modules else target
            if found in modules:
                yield found


def room_of(name: str, modules: dict[str, Path]) -> str:
    """Return the dotted name of the folder of a module."""
    return name if modules[name].name == "__init__.py" else name.rpartition(".")[0]


def static_counts(checkout: Path) -> dict[str, int]:
    """Return the counts that need no run."""
    folders = source_folders(checkout)
    modules = modules_of(folders)
    edges = {(name, to) for name, path in modules.items() for to in imports_of(name, path, modules)}
    entered = {to for name, to in edges if name.split(".")[0] != to.split(".")[0]}
    between = {(room_of(a, modules), room_of(b, modules)) for a, b in edges}
    rooms = sorted({room for pair in between for room in pair})
    faces = [path for path in modules.values() if path.name == "__init__.py" and _is_face(path)]
    return {
        "files": len(modules),
        "lines": sum(len(path.read_text(encoding="utf-8").splitlines()) for path in modules.values()),
        "faces": len(faces),
        "modules entered across packages": len(entered),
        "pairs of rooms both ways": sum(
            (a, b) in between and (b, a) in between for a, b in combinations(rooms, 2)
        ),
    }


def _is_face(path: Path) -> bool:
    """Return whether a package declares its public names."""
    return "__all__" in path.read_text(encoding="utf-8")


@dataclass(frozen=True)
class Way:
    """Call path of one run in the main thread; each pair of functions is counted once."""

    files: int
    rooms: int
    moves: int
    """Number of pairs of packages of which one calls the other."""
    returns: int
    """Number of calls into a package that is already on the call stack (callbacks)."""

    def __str__(self) -> str:
        """Return the counts as one line."""
        return (
            f"{self.files} files in {self.rooms} rooms, {self.moves} moves between packages, "
            f"{self.returns} returns to an open package"
        )


def call_path(checkout: Path, arguments: list[str], folder: Path) -> Way:
    """Run a command of a checkout and return its call path."""
    folders = source_folders(checkout)
    is_namespace = any(path.parent.name == "vibench" for path in folders.values())
    answer = folder / "answer.json"
    environment = {
        **os.environ,
        "HOUSE_FOLDERS": json.dumps({str(path.resolve()): name for name, path in folders.items()}),
        "HOUSE_ANSWER": str(answer),
        "PYTHONPATH": os.pathsep.join(str(checkout / name) for name in folders)
        if is_namespace
        else str(checkout),
    }
    subprocess.run(
        [sys.executable, "-c", FOLLOWED, "vibench.cli" if is_namespace else "cli", *arguments],
        cwd=checkout,
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    code, steps = json.loads(answer.read_text())
    if code not in (0, None):
        raise SystemExit(f"vibench {' '.join(arguments)} ended with {code}; nothing was counted")
    return Way(
        files=len({here[2] for _, here, _ in steps}),
        rooms=len({here[1] for _, here, _ in steps}),
        moves=len({(before[0], here[0]) for before, here, _ in steps if before[0] != here[0]}),
        returns=sum(is_open for _, _, is_open in steps),
    )


CAMPAIGN = """name = "way"
[[measurements]]
name = "dwell"
[measurements.excitation]
kind = "dwell"
amplitude_vpp = 1.0
frequency_hz = 100.0
duration_s = 2.0
"""


def main() -> None:
    """Print the counts and the call paths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--checkout", type=Path, default=Path(__file__).resolve().parent.parent)
    checkout = parser.parse_args().checkout.resolve()
    for what, value in static_counts(checkout).items():
        print(f"{what}: {value}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "way.toml").write_text(CAMPAIGN)
        predict = ["predict", "--amplitude", "5e-6", "--frequency", "260", "--window", "1", "--json"]
        measure = ["measure", str(folder / "way.toml"), "--out", str(folder / "out")]
        analyse = ["analyse", str(folder / "out" / "dwell.h5"), "--out", str(folder / "report")]
        for arguments in (predict, measure, analyse):
            print(f"way of {arguments[0]}: {call_path(checkout, arguments, folder)}")


if __name__ == "__main__":
    main()
