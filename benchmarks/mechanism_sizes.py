"""Print the lines of each mechanism at a commit and now, as a table.

    python benchmarks/mechanism_sizes.py [--before COMMIT]

Python files, stubs, templates and C++ count with comments and blank lines; tests do not count.
"""

import argparse
import subprocess
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BEFORE = "7e7eec57"
"""The last commit before the code was restructured."""
SUFFIXES = (".py", ".pyi", ".j2", ".hpp", ".cpp")
SIM, ANALYSIS = "sim/vibench/sim/", "analysis/vibench/analysis/"
DRIVERS, RIG = "acquisition/vibench/acquisition/drivers/", "virtual_rig/vibench/virtual_rig/"
MORE = "extensions/more_drivers/vibench_more_drivers/"
INSTRUMENTS = [RIG + name for name in ("daqmx/*", "generator/*", "usb/*")]
RESULTS = [ANALYSIS + name for name in ("tables.py", "results/*", "report/*", "kinds/*", "kinds.py")]
AFG = [
    DRIVERS + name
    for name in ("_afg1022*", "_generator_limits.py", "_limits.py", "_scpi.py", "_visa_link.py")
]
ENGINES = ("collision", "contact", "flight", "kernels", "lanes", "power_law", "rigid", "slots", "stepping")
EXECUTORS = [SIM + "study/_executor.py", SIM + "study/_cluster.py"]
MECHANISMS = {
    "motion, contact laws, chains, shaker": (
        [f"{SIM}{name}/*" for name in (*ENGINES, "sticking", "motion", "chain", "shaker")],
        ["native/*", *(f"{SIM}{name}/*" for name in ("engine", "motion", "chain", "shaker"))],
    ),
    "prediction": ([SIM + "scene/*", SIM + "costs/*"], [SIM + "scene/*"]),
    "studies and maps": ([SIM + "study/*", SIM + "maps/*"], [SIM + "study/*", SIM + "maps/*"]),
    "background work": (
        [
            "gui/*/background/*",
            "gui/*/_simulator.py",
            "cli/*/analyst.py",
            *EXECUTORS,
            SIM + "study/_threads.py",
        ],
        [SIM + "background.py", "gui/*/background.py", *EXECUTORS],
    ),
    "commands and options": (["cli/*"], ["cli/*"]),
    "results, figures and reports": ([*RESULTS, ANALYSIS + "figures/*"], RESULTS),
    "AFG1022 driver": (AFG, AFG),
    "all drivers": ([DRIVERS + "*"], [DRIVERS + "*", MORE + "[!v]*"]),
    "virtual instruments": (INSTRUMENTS, [*INSTRUMENTS, MORE + "virtual_*"]),
    "paper": (
        [SIM + "accuracy_benchmark/*", ANALYSIS + "reproduction/*", ANALYSIS + "paper_figures/*"],
        [SIM + "accuracy_benchmark.py", "studies/*"],
    ),
}


def git(*arguments: str) -> str:
    """Run git in this repository and return what it prints."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def lines_of(names: list[str], patterns: list[str], commit: str) -> int:
    """Return the number of lines of the files that match any pattern, at a commit."""
    matching = [
        name
        for name in names
        if name.endswith(SUFFIXES)
        and not Path(name).name.startswith("test_engine")
        and any(fnmatch(name, pattern) for pattern in patterns)
    ]
    texts = (git("show", f"{commit}:{name}") for name in matching)
    return sum(text.count("\n") for text in texts)


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--before", default=BEFORE, metavar="COMMIT")
    before = options.parse_args().before
    names = {each: git("ls-tree", "-r", "--name-only", each).splitlines() for each in (before, "HEAD")}
    print("| mechanism | before | now |\n|---|---|---|")
    for mechanism, patterns in MECHANISMS.items():
        old, new = (
            lines_of(names[commit], places, commit)
            for commit, places in zip((before, "HEAD"), patterns, strict=True)
        )
        print(f"| {mechanism} | {old:,} | {new:,} |")


if __name__ == "__main__":
    main()
