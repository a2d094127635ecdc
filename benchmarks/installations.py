"""Test new installations: their size, whether they work, and how long the first commands take.

    python benchmarks/installations.py --out table.md
    python benchmarks/installations.py --python python3.12 python3.13 --extra none bench --form wheel

Each combination of interpreter, form (wheel, editable), extra and versions (newest, lowest) gets a new
environment, and runs from an empty folder. The commands are ``vibench --version``, a prediction, and the same
again. If the extra allows it, the shipped campaign and its analysis follow. Times are processor time, because
other programs may run.
"""

import argparse
import itertools
import json
import os
import resource
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("none", "figures", "bench", "gui")
"""Extras; each includes all previous extras."""
PREDICT = ("predict", "--model", "hertz", "--amplitude", "5e-6", "--frequency", "260", "--json")


@dataclass
class Installation:
    """One environment with its results."""

    python: str
    form: str
    extra: str
    versions: str
    megabytes: float = 0.0
    packages: int = 0
    processor_s: dict[str, float] = field(default_factory=dict)
    trouble: str = ""

    @property
    def target(self) -> str:
        """Requirement that pip installs."""
        extras = "" if self.extra == "none" else f"[{self.extra}]"
        return f"{ROOT}{extras}"


def lowest(python_version: str, extra: str) -> list[str]:
    """Return each library of an installation with its lowest allowed version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    wanted = EXTRAS[: EXTRAS.index(extra) + 1]
    texts = [*project["dependencies"], *(text for each in wanted for text in extras.get(each, ()))]
    environment = {**default_environment(), "python_version": python_version}
    found = []
    for text in texts:
        requirement = Requirement(text)
        if requirement.name == "vibench" or (
            requirement.marker and not requirement.marker.evaluate(environment)
        ):
            continue
        (version,) = (each.version for each in requirement.specifier if each.operator in {">=", "=="})
        brackets = f"[{','.join(sorted(requirement.extras))}]" if requirement.extras else ""
        found.append(f"{requirement.name}{brackets}=={version}")
    return found


def run_timed(command: list[str], folder: Path, environment: dict[str, str]) -> float:
    """Run a command, and return its processor time with that of its children [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def examine(each: Installation, folder: Path) -> None:
    """Create the environment, and run the first commands of a new user."""
    subprocess.run([each.python, "-m", "venv", folder / "venv"], check=True)
    program = folder / "venv" / "bin"
    python = str(program / "python")
    kept = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    environment = {
        **kept,
        "VIBENCH_STATE_DIR": str(folder / "state"),
        "QT_QPA_PLATFORM": "offscreen",
    }
    asked = "import sys; print('%d.%d' % sys.version_info[:2])"
    version = subprocess.run([python, "-c", asked], check=True, capture_output=True, text=True).stdout.strip()
    pinned = lowest(version, each.extra) if each.versions == "lowest" else []
    editable = ["--editable"] if each.form == "editable" else []
    pip = [python, "-m", "pip", "install", "--quiet", "--prefer-binary", *pinned, *editable, each.target]
    each.processor_s["install"] = run_timed(pip, folder, environment)
    installed = [python, "-m", "pip", "list", "--format", "json"]
    listed = subprocess.run(installed, check=True, capture_output=True, text=True).stdout
    each.packages = len(json.loads(listed)) - 1  # without pip, which every environment has
    each.megabytes = size_mb(folder / "venv" / "lib")
    empty = folder / "empty"
    empty.mkdir()
    steps = {
        "version": ("--version",),
        "first prediction": PREDICT,
        "second prediction": PREDICT,
    }
    if each.extra in {"bench", "gui"}:
        steps["measure quick"] = ("measure", "quick", "--out", "out")
        steps["analyse"] = ("analyse", "out/noise.h5", "--out", "report")
    for name, arguments in steps.items():
        each.processor_s[name] = run_timed([str(program / "vibench"), *arguments], empty, environment)


def size_mb(folder: Path) -> float:
    """Return the size of the files of a folder without pip [MB]."""
    return (
        sum(
            path.stat().st_size
            for path in folder.rglob("*")
            if path.is_file() and not path.is_symlink() and "pip" not in path.parts
        )
        / 1e6
    )


def table(installations: list[Installation]) -> str:
    """Return the results as a Markdown table."""
    steps = list(dict.fromkeys(step for each in installations for step in each.processor_s))
    head = ["Python", "form", "extra", "versions", "packages", "MB", *(f"{step} [s]" for step in steps)]
    rows = [head, ["---"] * len(head)]
    for each in installations:
        times = [f"{each.processor_s[step]:.1f}" if step in each.processor_s else "-" for step in steps]
        told = [Path(each.python).name.removeprefix("python"), each.form, each.extra, each.versions]
        figures = [str(each.packages), f"{each.megabytes:.0f}", *times]
        rows.append([*told, *([*figures[:-1], f"{figures[-1]} {each.trouble}".strip()])])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def main() -> None:
    """Test every requested combination, and print the table after each."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--python", nargs="+", default=[sys.executable], metavar="PROGRAM")
    parser.add_argument("--form", nargs="+", default=["wheel", "editable"], choices=["wheel", "editable"])
    parser.add_argument("--extra", nargs="+", default=EXTRAS, choices=EXTRAS)
    parser.add_argument("--versions", nargs="+", default=["newest"], choices=["newest", "lowest"])
    parser.add_argument("--out", type=Path, metavar="FILE.md")
    options = parser.parse_args()
    seen: list[Installation] = []
    for asked in itertools.product(options.python, options.form, options.extra, options.versions):
        seen.append(Installation(*asked))
        with tempfile.TemporaryDirectory() as folder:
            try:
                examine(seen[-1], Path(folder))
            except subprocess.CalledProcessError as error:
                seen[-1].trouble = f"FAILED: {' '.join(map(str, error.cmd[:6]))}"
                print(error.stderr, file=sys.stderr)
        print(table(seen), flush=True)
        if options.out is not None:
            options.out.write_text(table(seen), encoding="utf-8")


if __name__ == "__main__":
    main()
