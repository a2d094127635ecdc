"""The engine passes the sanitizers of g++, also with broken structures in its C interface."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vibench.sim import Harmonic, gong2025
from vibench.sim.engine.run import native_engine
from vibench.sim.engine.scene import collision_structure, power_structure, scene_of

ROOT = Path(__file__).resolve().parents[3]
FUZZ = Path(__file__).parent / "fuzz_interface.py"
SANITIZED = (
    *("g++", "-std=c++20", "-O0", "-g1", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", "-ffp-contract=off"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"),
)
PROGRAM = """
import ctypes, sys
words = [each.encode() for each in sys.argv[1:]]
sys.exit(ctypes.CDLL(sys.argv[1]).main(len(words), (ctypes.c_char_p * len(words))(*words)))
"""
LAWS = ("hertz", "hunt_crossley:0.5", "linear_gap", "rigid:0.8", "rigid:0.3", "linear", "power:3+5+7")
needs_gcc = pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++ here for its sanitizers")


def output_of(*command, **environment):
    words = [str(word) for word in command]
    result = subprocess.run(words, env=os.environ | environment, capture_output=True, text=True, check=False)
    assert result.returncode == 0, f"{words}\n{result.stdout[-3000:]}{result.stderr[-3000:]}"
    return result.stdout


@pytest.fixture(scope="module")
def sanitized_library(tmp_path_factory):
    """Build the engine with its test program as one library, without optimisation to save time."""
    library = tmp_path_factory.mktemp("engine") / "sanitized.so"
    output_of(*SANITIZED, "-shared", "-fPIC", ROOT / "native" / "test_engine.cpp", "-o", library)
    return library


def output_under_sanitizers(*words):
    runtime = output_of("g++", "-print-file-name=libasan.so").strip()
    return output_of(sys.executable, *words, LD_PRELOAD=runtime, ASAN_OPTIONS="detect_leaks=0")


@needs_gcc
@pytest.mark.thorough
@pytest.mark.timeout(600)
def test_the_native_test_program_passes_under_the_sanitizers(sanitized_library, tmp_path):
    engine = native_engine()
    shapes = collision_structure(engine).tobytes() + power_structure(engine).tobytes()
    for law in LAWS:
        scene = scene_of(engine, gong2025(contact=law), Harmonic(130.0, 20e-6))
        (tmp_path / law.replace(":", "_")).write_bytes(scene.tobytes() + shapes)
    assert "all checks passed" in output_under_sanitizers(
        "-c", PROGRAM, sanitized_library, *sorted(tmp_path.iterdir())
    )


def test_a_corrupted_c_structure_returns_an_error_code():
    assert "-1:" in output_of(sys.executable, FUZZ, native_engine().path, "--count", 400)


@needs_gcc
@pytest.mark.thorough
@pytest.mark.timeout(600)
def test_corrupted_c_structures_cause_no_undefined_behaviour(sanitized_library):
    output_under_sanitizers(FUZZ, sanitized_library, "--count", 300)
