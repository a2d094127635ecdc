"""A command that runs out of file descriptors or memory ends with one sentence and no traceback."""

import json
import re
import subprocess
import sys

import pytest

from vibench.cli.__main__ import COMMANDS
from vibench.stop_files import SWITCH_OFF

from .conftest import ENVIRONMENT

resource = pytest.importorskip("resource", reason="limits on a process exist on POSIX only")

TONE = """
name = "tiny"
[[measurements]]
name = "tone"
ramp_s = 0.1
ramp_step_s = 0.02
excitation = { kind = "dwell", amplitude_vpp = 0.1, frequency_hz = 150, settle_s = 0, duration_s = 0.2 }
"""


def run_limited(folder, name, most, *arguments):
    """Run ``vibench`` with a limit on a resource of its process."""
    number = getattr(resource, name)
    return subprocess.run(
        [sys.executable, "-m", "vibench.cli", *arguments],
        cwd=folder,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
        timeout=110,
        preexec_fn=lambda: resource.setrlimit(number, (most, resource.getrlimit(number)[1])),
    )


@pytest.mark.thorough
@pytest.mark.parametrize("most", [8, 16, 24])
def test_too_few_file_descriptors_end_a_measurement_without_a_traceback(tmp_path, most):
    (tmp_path / "tiny.toml").write_text(TONE, encoding="utf-8")
    ended = run_limited(
        tmp_path, "RLIMIT_NOFILE", most, "measure", "tiny.toml", "--out", "out", "--check", "waived"
    )
    assert "Traceback" not in ended.stderr
    assert (ended.returncode, ended.stderr.count("error: ")) in ((0, 0), (1, 1))


@pytest.mark.parametrize(
    ("most_mb", "arguments"),
    [
        (150, ("verify", ".")),
        (200, ("specimen",)),
        (250, ("measure", "tiny.toml", "--out", "out")),
        (300, ("bench", "check")),
        (450, ("predict", "--model", "linear", "--amplitude", "1e-6", "--frequency", "100")),
        (1100, ("demo",)),
    ],
)
def test_a_lack_of_address_space_is_reported_before_libraries_are_loaded(tmp_path, most_mb, arguments):
    ended = run_limited(tmp_path, "RLIMIT_AS", 1_000_000 * most_mb, *arguments)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert re.fullmatch(
        rf"error: this process may use {most_mb} MB of address space, but needs \d+ MB\. Nothing was done; "
        r"raise the limit \(ulimit -v \d+\) and try again\.\n",
        ended.stderr,
    )


def test_a_stop_command_without_enough_memory_advises_switching_the_amplifier_off(tmp_path):
    ended = run_limited(tmp_path, "RLIMIT_AS", 100_000_000, "stop")
    assert ended.returncode == 1
    assert ended.stderr.endswith(f"{SWITCH_OFF}.\n")


SPECTRUM = ("spectrum", "--amplitude", "1e-6", "--frequency", "260", "--duration", "1", "--settle", "0.1")


def test_a_full_disk_is_reported_before_a_computation(tmp_path):
    ended = run_limited(tmp_path, "RLIMIT_FSIZE", 10_000, *SPECTRUM, "--out", "out")
    assert (ended.returncode, ended.stdout) == (1, "")
    assert "cannot be written to (File too large). Nothing was computed; give a folder" in ended.stderr


@pytest.mark.thorough
def test_a_result_is_printed_if_the_disk_is_full_at_its_end(tmp_path):
    ended = run_limited(tmp_path, "RLIMIT_FSIZE", 20_000, *SPECTRUM, "--out", "out")
    assert ended.returncode == 1
    assert "contains the whole result" in " ".join(ended.stderr.split())
    (point,) = json.loads(ended.stdout[ended.stdout.index("\n{") :])["points"]
    assert len(point["exponents_per_s"]) == 6


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_is_refused_if_the_address_space_is_too_small(vibench_here, tmp_path, monkeypatch, name):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (100_000_000, resource.RLIM_INFINITY))
    ended = vibench_here(name, cwd=tmp_path)
    assert (ended.returncode, ended.stderr.count("\n")) == (1, 1)
    assert "100 MB of address space" in ended.stderr


@pytest.mark.parametrize(
    ("wrapped", "said"),
    [
        (MemoryError(), "out of memory"),
        (RuntimeError("can't start new thread"), "out of memory"),
        (ImportError("libllvmlite.so: failed to map segment from shared object"), "out of memory"),
        (SystemError("<built-in> returned NULL without setting an exception"), "out of memory"),
        (OSError(24, "Too many open files"), "cannot open more files"),
        (ImportError("x.so: cannot open shared object file: Too many open files"), "cannot open more files"),
    ],
)
def test_a_memory_error_in_another_exception_is_reported(vibench_here, tmp_path, monkeypatch, wrapped, said):
    def run_out_of_memory(*_arguments, **_named):
        try:
            raise wrapped
        except Exception as error:
            raise OSError("could not find a library") from error

    monkeypatch.setattr("vibench.cli.files.verify_recordings", run_out_of_memory)
    ended = vibench_here("verify", ".", cwd=tmp_path)
    assert (ended.returncode, ended.stderr.count("\n")) == (1, 1)
    assert said in ended.stderr


@pytest.mark.thorough
def test_a_bench_check_accepts_a_missing_recording_folder_and_does_not_create_the_folder(vibench, tmp_path):
    ended = vibench("bench", "check", "--out", "later/on", cwd=tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert not (tmp_path / "later").exists()
