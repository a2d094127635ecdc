"""Compile the native engine with the clang of the `ziglang` package, once per processor family.

    python native/build.py [FAMILY ...]

The default is the fastest family of this processor. hatch_build.py calls this during a package build.
VIBENCH_CXX names another compiler, whose results may differ in the last digits.
"""

import argparse
import hashlib
import importlib.util
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NATIVE = ROOT / "native"
ENGINE = ROOT / "sim" / "vibench" / "sim" / "engine"
LIBRARIES = ENGINE / "libraries"
FLAGS = (
    *("-std=c++20", "-O3", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-fvisibility=hidden"),
    "-Wno-psabi",  # no calling convention matters: wide vectors are passed only to inlined functions
    # For reproducible digits, fused multiply-adds are used only where the source asks for them.
    *("-ffp-contract=off", "-fno-math-errno"),
    # No C++ library: it takes a minute to compile, and differs between systems.
    *("-fno-exceptions", "-fno-rtti", "-nostdinc++", "-nostdlib++"),
)
ZIG_FLAGS = ("-fno-sanitize=undefined", "-s")  # zig's default build traps; tests use g++'s sanitizers
SYSTEMS = {"linux": "linux-gnu.2.17", "win32": "windows-gnu", "darwin": "macos"}
ENDINGS = {"linux": "so", "win32": "dll", "darwin": "dylib"}


def sources_digest() -> str:
    """Return a digest of everything that determines a library's behaviour."""
    digest = hashlib.sha256()
    for path in sorted([*NATIVE.glob("*.hpp"), NATIVE / "api.cpp", NATIVE / "build.py"]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


def own_families() -> tuple[str, ...]:
    """Return the families that this processor supports, the fastest first."""
    spec = importlib.util.spec_from_file_location("vibench_processor", ENGINE / "processor.py")
    processor = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(processor)
    return processor.usable_families()


def compiler(family: str, system: str) -> list[str]:
    """Return the compiler command for a family and a system (a value of `sys.platform`)."""
    if os.environ.get("VIBENCH_CXX"):
        return [*shlex.split(os.environ["VIBENCH_CXX"]), f"-march={family.replace('_', '-')}"]
    if importlib.util.find_spec("ziglang") is None:
        sys.exit("The native engine needs a compiler: pip install ziglang, or set VIBENCH_CXX.")
    machine = "aarch64" if family == "arm64" else "x86_64"
    processor = "baseline" if family == "arm64" else family
    target = ["-target", f"{machine}-{SYSTEMS[system]}", f"-mcpu={processor}"]
    return [sys.executable, "-m", "ziglang", "c++", *target, *ZIG_FLAGS]


def compile_engine(family: str, system: str = sys.platform) -> Path:
    """Compile the library of a family if it is missing, and delete libraries built from other sources."""
    target = LIBRARIES / f"engine-{family}-{sources_digest()}.{ENDINGS[system]}"
    if not target.is_file():
        LIBRARIES.mkdir(exist_ok=True)
        # Two processes may build at once, each in a separate folder; the last one to finish wins.
        with tempfile.TemporaryDirectory(dir=LIBRARIES) as folder:
            made = Path(folder) / target.name
            command = [*compiler(family, system), *FLAGS, str(NATIVE / "api.cpp"), "-o", str(made)]
            subprocess.run(command, check=True)
            made.replace(target)
    for other in LIBRARIES.glob(f"engine-{family}-*.{ENDINGS[system]}"):
        if other != target:
            other.unlink(missing_ok=True)
    return target


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("family", nargs="*", help="x86_64, x86_64_v3, x86_64_v4 or arm64")
    for each in options.parse_args().family or own_families()[:1]:
        print(compile_engine(each))
