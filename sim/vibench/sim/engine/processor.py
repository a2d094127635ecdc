"""Processor families for which the native engine is compiled, and those that this processor supports.

The build hook also imports this file, so this file may import only the standard library.
"""

import ctypes
import platform
import sys
from pathlib import Path

FAMILIES = ("x86_64", "x86_64_v3", "x86_64_v4", "arm64")
"""Processor families by their names in compilers: any x86-64, x86-64 with AVX2 or with AVX-512, and ARM."""
_ARM = {"arm64", "aarch64"}
_X86 = {"x86_64", "amd64"}
_V3 = {"avx2", "bmi1", "bmi2", "fma", "movbe", "abm"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
_WINDOWS_AVX2, _WINDOWS_AVX512 = 40, 41
"""Codes of processor features for IsProcessorFeaturePresent (winnt.h)."""


def usable_families() -> tuple[str, ...]:
    """Return the families whose code this processor can run, the fastest first; empty if unknown."""
    machine = platform.machine().lower()
    if machine in _ARM:
        return ("arm64",)
    if machine not in _X86:
        return ()
    level = _level()
    return tuple(reversed(FAMILIES[:level]))


def _level() -> int:
    """Return 3 for AVX-512, 2 for AVX2, and 1 otherwise or if the features are unknown."""
    if sys.platform == "win32":
        has = ctypes.windll.kernel32.IsProcessorFeaturePresent
        return 1 + bool(has(_WINDOWS_AVX2)) * (1 + bool(has(_WINDOWS_AVX512)))
    else:  # noqa: RET505 - a type checker for Windows must see that this part is for other systems
        described = Path("/proc/cpuinfo")
        if not described.is_file():
            return 1
        lines = described.read_text(encoding="utf-8", errors="replace").splitlines()
        flags = next((set(line.split()) for line in lines if line.startswith("flags")), set())
        return 3 if flags >= _V4 else 2 if flags >= _V3 else 1
