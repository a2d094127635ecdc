"""Count the lines that the native engine replaced, and the lines of their replacement.

    python benchmarks/native_size.py [--before COMMIT]

Replaced are, as of COMMIT, the packages of `sim` that existed only for compiled kernels, and every other
module with a compiled kernel. The replacement is `native/`, `vibench.sim.engine`, the build hook and the
remaining parts of the replaced files. Stubs, comments and blank lines count.
"""

import argparse
import re
import subprocess
from collections import Counter
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parent.parent
BEFORE = "7e7eec57"
"""The last commit without native code."""
PACKAGES = (
    *("collision", "contact", "flight", "kernels", "lanes"),
    *("power_law", "rigid", "slots", "stepping", "sticking"),
)
"""Packages of `sim` that are replaced completely."""
PORTIONS = ("acquisition", "analysis", "cli", "gui", "sim", "virtual_rig")
KERNEL = re.compile(r"^@(kernel|kernel_without_refcount|inlined|njit|rates_of)\b", re.MULTILINE)
NATIVE = ("native", "sim/vibench/sim/engine", "hatch_build.py")
LANGUAGES = {".py", ".pyi", ".hpp", ".cpp"}


def git(*arguments: str) -> str:
    """Run git in this repository and return what it prints."""
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def is_replaced(path: PurePosixPath, text: str) -> bool:
    """Whether the native engine replaces a module, in whole or in part."""
    in_package = path.parts[:3] == ("sim", "vibench", "sim") and path.parts[3] in PACKAGES
    return in_package or KERNEL.search(text) is not None


def replaced_lines(commit: str) -> Counter[PurePosixPath]:
    """Return the lines of every replaced file at a commit."""
    lines: Counter[PurePosixPath] = Counter()
    for name in git("ls-tree", "-r", "--name-only", commit, *PORTIONS).splitlines():
        path = PurePosixPath(name)
        if path.suffix in {".py", ".pyi"}:
            text = git("show", f"{commit}:{name}")
            if is_replaced(path, text):
                lines[path] = text.count("\n")
    return lines


def present_lines(path: PurePosixPath) -> int:
    """Return the lines that a file has now; 0 when it is gone."""
    whole = ROOT / path
    return whole.read_text(encoding="utf-8").count("\n") if whole.is_file() else 0


def native_lines() -> Counter[str]:
    """Return the lines of the native engine, by language."""
    lines: Counter[str] = Counter()
    for name in git("ls-files", *NATIVE).splitlines():
        path = PurePosixPath(name)
        if path.suffix in LANGUAGES and not path.name.startswith("test_"):
            lines["C++" if path.suffix in {".hpp", ".cpp"} else "Python"] += present_lines(path)
    return lines


def main() -> None:
    """Print both counts and their ratio."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--before", default=BEFORE, metavar="COMMIT")
    before = replaced_lines(options.parse_args().before)
    packages: Counter[str] = Counter()
    for path, count in before.items():
        packages["/".join((path.parts[0], *path.parts[2:4]))] += count
    for package, count in packages.most_common():
        print(f"{count:7d}  {package}")
    native = native_lines()
    left = sum(present_lines(path) for path in before)
    total = left + native.total()
    print(f"{before.total():7d}  lines to replace, in {len(before)} files")
    print(f"{left:7d}  of them still here")
    print(f"{native['C++']:7d}  C++ of the native engine")
    print(f"{native['Python']:7d}  Python of the native engine")
    print(f"{100.0 * total / before.total():6.0f} %  of the lines to replace stand now; the aim is 60 %")


if __name__ == "__main__":
    main()
