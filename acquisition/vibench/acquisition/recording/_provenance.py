"""Who made a recording: versions, commit, machine and moment, collected once at the start."""

import os
import platform
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import h5py

from vibench.sim.engine.library import native_digest

CHECKOUT = Path(__file__).resolve().parents[4]
PACKAGES = ("vibench", "numpy", "scipy", "h5py", "pydantic", "pyvisa", "pyvisa-py", "nidaqmx")
GIT_PATIENCE_S = 5.0


@dataclass(frozen=True)
class Provenance:
    """What is needed to make the same recording again, apart from plan and bench."""

    started_utc: str
    """ISO 8601, with microseconds, from the computer's clock."""
    host: str
    platform: str
    process: int
    python: str
    packages: Mapping[str, str]
    """Version of each package that has a say in the data; of the native engine the digest of its sources."""
    commit: str
    """Git commit when run from a checkout (``+changes`` when files differ from it), else empty."""


def collect_provenance() -> Provenance:
    """Look at this process, machine and installation, now."""
    return Provenance(
        started_utc=datetime.now(UTC).isoformat(timespec="microseconds"),
        host=platform.node(),
        platform=platform.platform(),
        process=os.getpid(),
        python=platform.python_version(),
        packages=_package_versions(),
        commit=_commit(),
    )


@cache
def _package_versions() -> Mapping[str, str]:
    found = {"hdf5": str(h5py.version.hdf5_version), "native engine": native_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


@cache
def _commit() -> str:
    """Commit of the checkout this code runs from; an installed wheel lies in none."""
    if not (CHECKOUT / ".git").exists():
        return ""
    commit = _git("rev-parse", "HEAD")
    changes = _git("status", "--porcelain", "--untracked-files=no")
    return f"{commit}+changes" if commit and changes else commit


def _git(*arguments: str) -> str:
    git = shutil.which("git")
    if git is None:
        return ""
    try:
        answer = subprocess.run(  # noqa: S603 - fixed arguments, no shell
            [git, "-C", str(CHECKOUT), *arguments],
            capture_output=True,
            text=True,
            timeout=GIT_PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip() if answer.returncode == 0 else ""
