"""Compile the native engine while the package is built: native/build.py says how.

An editable install compiles for its own processor only, a wheel for all families of its system.
VIBENCH_TARGET makes a wheel for another system: linux-x86_64, linux-arm64, windows-x86_64 or macos-arm64.
"""

import importlib.util
import os
import platform
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

X86 = ("x86_64", "x86_64_v3", "x86_64_v4")
TARGETS = {
    "linux-x86_64": ("linux", X86, "manylinux_2_17_x86_64"),
    "linux-arm64": ("linux", ("arm64",), "manylinux_2_17_aarch64"),
    "windows-x86_64": ("win32", X86, "win_amd64"),
    "macos-arm64": ("darwin", ("arm64",), "macosx_13_0_arm64"),
}
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "macos"}
MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "arm64", "arm64": "arm64"}


class NativeEngine(BuildHookInterface):
    """Puts compiled libraries into the package."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, before files are collected."""
        spec = importlib.util.spec_from_file_location(
            "vibench_native_build", Path(self.root, "native", "build.py")
        )
        build = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(build)
        system, families, tag = TARGETS[os.environ.get("VIBENCH_TARGET", own_target())]
        if version == "editable":
            families = build.own_families()[:1]
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{tag}"
        for family in families:
            library = build.compile_engine(family, system)
            build_data["force_include"][str(library)] = f"vibench/sim/engine/libraries/{library.name}"


def own_target() -> str:
    """Return the target that this computer is."""
    return f"{SYSTEMS[sys.platform]}-{MACHINES[platform.machine().lower()]}"
