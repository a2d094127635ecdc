"""The README's two commands on a bare Debian: no compiler, no git, none of Qt's libraries, no vibench before.

    sudo python benchmarks/bare_machine.py FOLDER

debootstrap makes the system in the given folder, which takes some 3 GB in the end, and chroot runs in it. The
commands are those of README.md. Each ends with its exit code, its seconds and the last lines that it printed.
"""

import argparse
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ABSENT = ("gcc", "cc", "clang", "git", "libGL.so.1")
LINES = 4
AFTERWARDS = ("env QT_QPA_PLATFORM=offscreen vibench gui",)
"""Beyond the README's two: the window, which needs libraries of the system."""


def readme_commands() -> list[str]:
    """Return what the README tells a newcomer to type."""
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("## Two commands")[1]
    (block,) = re.findall(r"^```\n(.*?)^```", section.split("## Next steps")[0], re.DOTALL | re.MULTILINE)
    return str(block).splitlines()


def make(folder: Path, release: str, mirror: str) -> None:
    """Make the system, and put a copy of the sources that git knows into it."""
    packages = "python3,python3-venv,ca-certificates"
    subprocess.run(
        ["debootstrap", "--variant=minbase", f"--include={packages}", release, folder, mirror], check=True
    )
    shutil.copy("/etc/resolv.conf", folder / "etc/resolv.conf")
    (folder / "work").mkdir()
    sources = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "x", "-C", folder / "work"], input=sources, check=True)


def run(folder: Path, command: str, limit_s: float) -> None:
    """Type one command in the new system, and show how it ended."""
    begun = time.monotonic()
    script = f"cd /work && . .venv/bin/activate && timeout {limit_s:g} {command}"
    clean = ("env", "-i", "HOME=/root", "PATH=/usr/bin:/bin:/usr/sbin:/sbin")
    typed = [*clean, "chroot", str(folder), "bash", "-c", script]
    ended = subprocess.run(typed, capture_output=True, text=True, check=False)
    print(f"$ {command}\n[exit code {ended.returncode}, {time.monotonic() - begun:.0f} s]")
    for line in (ended.stdout + ended.stderr).splitlines()[-LINES:]:
        print(f"  {line}")


def main() -> None:
    """Make the system and type the commands."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="where the system goes; it must not exist")
    parser.add_argument("--release", default="bookworm")
    parser.add_argument("--mirror", default="http://deb.debian.org/debian")
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds for each command")
    options = parser.parse_args()
    if options.folder.exists():
        sys.exit(f"{options.folder} exists; give a folder that does not")
    make(options.folder, options.release, options.mirror)
    for place in ("proc", "dev"):
        subprocess.run(["mount", "--bind", f"/{place}", options.folder / place], check=True)
    try:
        found = f"for each in {' '.join(ABSENT)}; do which $each || ldconfig -p | grep $each; done; true"
        create = "cd /work && python3 -m venv .venv"
        subprocess.run(["chroot", options.folder, "bash", "-c", f"{create}; {found}"], check=True)
        for command in (*readme_commands(), *AFTERWARDS):
            run(options.folder, command, options.limit)
    finally:
        for place in ("proc", "dev"):
            subprocess.run(["umount", options.folder / place], check=True)


if __name__ == "__main__":
    main()
