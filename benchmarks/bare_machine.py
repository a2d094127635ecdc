"""Test the README's commands on a minimal Debian without compiler, git, Qt's libraries or vibench.

    sudo python benchmarks/bare_machine.py FOLDER

debootstrap installs the system in the given folder, which needs about 3 GB, and chroot runs in it. For each
command of README.md, the script prints exit code, time and the last lines of output.
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
"""Additional command: the window, which needs libraries of the system."""


def readme_commands() -> list[str]:
    """Return the commands that the README tells a new user to type."""
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("## Two commands")[1]
    (block,) = re.findall(r"^```\n(.*?)^```", section.split("## Next steps")[0], re.DOTALL | re.MULTILINE)
    return str(block).splitlines()


def make(folder: Path, release: str, mirror: str) -> None:
    """Install the system, and copy the committed sources into it."""
    packages = "python3,python3-venv,ca-certificates"
    subprocess.run(
        ["debootstrap", "--variant=minbase", f"--include={packages}", release, folder, mirror], check=True
    )
    shutil.copy("/etc/resolv.conf", folder / "etc/resolv.conf")
    (folder / "work").mkdir()
    sources = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
    subprocess.run(["tar", "x", "-C", folder / "work"], input=sources, check=True)


def run(folder: Path, command: str, limit_s: float) -> None:
    """Run one command in the new system, and print exit code, time and last lines."""
    begun = time.monotonic()
    script = f"cd /work && . .venv/bin/activate && timeout {limit_s:g} {command}"
    clean = ("env", "-i", "HOME=/root", "PATH=/usr/bin:/bin:/usr/sbin:/sbin")
    typed = [*clean, "chroot", str(folder), "bash", "-c", script]
    ended = subprocess.run(typed, capture_output=True, text=True, check=False)
    print(f"$ {command}\n[exit code {ended.returncode}, {time.monotonic() - begun:.0f} s]")
    for line in (ended.stdout + ended.stderr).splitlines()[-LINES:]:
        print(f"  {line}")


def main() -> None:
    """Install the system and run the commands."""
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
