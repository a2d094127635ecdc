"""Without vibench-fast-loop its plans, benches and recordings are refused with a sentence that names it."""

from pathlib import Path

import pytest

import vibench_fast_loop
from tests.analysis.conftest import synthetic
from tests.cli.in_this_process import json_of
from vibench.acquisition.excitation.plan import BaseLevel
from vibench_fast_loop.branch_continuation import BranchContinuation

ROOT = Path(__file__).resolve().parents[3]
SENTENCE = (
    "needs vibench-fast-loop, which is not installed: run 'pip install extensions/fast_loop' in the "
    "folder of vibench's sources"
)


@pytest.fixture
def recording(tmp_path):
    """Return a recording of two points of a branch."""
    frequencies = (95.0, 96.0)
    motions = [synthetic.sine(4.0, each, 0.5e-6) for each in frequencies]
    base = synthetic.Motion(
        *(
            synthetic.np.concatenate([getattr(each, name) for each in motions])
            for name in ("displacement_m", "acceleration")
        )
    )
    velocity = synthetic.np.concatenate([synthetic.response_of(each)[0] for each in motions])
    parts = [
        synthetic.Part("branch", 4.5 * n + 2.5, 4.5 * n + 3.5, {"point": n, "frequency_hz": each})
        for n, each in enumerate(frequencies)
    ]
    plan = BranchContinuation(
        amplitude_vpp=1,
        base_level=BaseLevel(displacement_m=0.5e-6),
        start_hz=95,
        low_hz=94,
        high_hz=97,
        record_s=1.0,
    )
    return synthetic.write_recording(tmp_path, plan, base, velocity, parts, name="branch")


def test_the_fast_loop_package_is_missing_only_in_the_second_environment(run):
    assert vibench_fast_loop.__file__.startswith(str(ROOT))
    assert "No module named 'vibench_fast_loop'" in run("-c", "import vibench_fast_loop").stderr


@pytest.mark.thorough
@pytest.mark.parametrize(
    "given", [("branch",), ("quick", "--bench", "virtual_rig_controller")], ids=["plan", "bench"]
)
def test_a_measurement_that_needs_the_missing_package_is_refused(run, given, tmp_path):
    told = run("-m", "vibench.cli", "measure", *given, "--out", "out", "--estimate")
    assert told.returncode == 1
    assert SENTENCE in " ".join(told.stderr.split())
    assert len(told.stderr.strip().splitlines()) <= 4
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_a_branch_recording_is_refused_with_a_readable_message_without_its_package(run, recording):
    told = run("-m", "vibench.cli", "analyse", recording, "--json")
    assert told.returncode == 1
    assert SENTENCE in " ".join(told.stderr.split())
    assert "update vibench" not in told.stderr
    drawn = run("-m", "vibench.cli", "analyse", recording, "--out", "report")
    assert SENTENCE in " ".join((drawn.stdout + drawn.stderr).split())
    assert len(json_of("analyse", recording)) > 1


@pytest.mark.thorough
def test_the_window_lists_only_tests_that_need_no_missing_package(run):
    code = (
        "from vibench.gui.pages.test.test_page import shipped_tests\n"
        "print(*sorted({each.measurement.excitation.kind for each in shipped_tests()}))"
    )
    listed = run("-c", code)
    assert listed.returncode == 0, listed.stderr
    assert "dwell" in listed.stdout
    assert "branch_continuation" not in listed.stdout
