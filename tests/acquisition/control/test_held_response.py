"""A response held at a constant amplitude agrees with the closed form; failures are flagged."""

import numpy as np
import pytest

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import HeldResponse, Measurement, RunState
from vibench.acquisition.recording import HeldResponseNote, Hold, feedback_note
from vibench.acquisition.rig import specimen_of

K1 = 2.1e-3 * (2 * np.pi * 100) ** 2


@pytest.fixture
def hold_response(tmp_path):
    """Return a function that carries out a held response on a rig and returns its notes."""

    def carry_out(rig, plan):
        with open_bench(rig) as bench:
            outcome = run_measurement(bench, Measurement(name="held", excitation=plan), tmp_path / "held.h5")
        assert outcome.state is RunState.FINISHED
        with open_recording(outcome.path) as recording:
            notes = [feedback_note(event) for event in recording.events]
            steps = [each for each in recording.segments if each.label == "step"]
        found = [each for each in notes if isinstance(each, HeldResponseNote)]
        assert len(found) == len(steps)
        return found

    return carry_out


@pytest.mark.thorough
def test_the_base_level_of_a_held_response_matches_the_closed_form(rig, hold_response):
    plan = HeldResponse(amplitude_vpp=1, frequencies_hz=(88, 90, 92), response_m=1e-6, record_s=0.5)
    specimen = specimen_of(rig)
    for each in hold_response(rig, plan):
        omega = 2 * np.pi * each.frequency_hz
        dynamic = specimen.stiffness_matrix + 1j * omega * specimen.damping_matrix
        dynamic = dynamic - omega**2 * specimen.mass_matrix
        pushed = [specimen.stiffnesses[0] + 1j * omega * specimen.dampings[0], 0, 0]
        against = abs(np.linalg.solve(dynamic, pushed)[0] - 1)
        assert each.level is Hold.WITHIN
        assert each.response_m == pytest.approx(1e-6, rel=0.02)
        assert each.base_m_per_s2 == pytest.approx(1e-6 / against * omega**2, rel=0.03)


@pytest.mark.thorough
def test_an_unstable_branch_is_recorded_and_flagged(rig, hold_response):
    # Between the folds of a hardening spring the motion leaves the branch faster than feedback can hold it.
    hard = {"contact": "power:3", "gap_m": 99e-6, "hertz_stiffness": 0.1 * K1 * 1e-4 / 1e-9}
    hardening = rig.model_copy(update={"specimen": rig.specimen.model_copy(update=hard)})
    plan = HeldResponse(amplitude_vpp=4, frequencies_hz=(103,), response_m=6e-6, longest_wait_s=8)
    (found,) = hold_response(hardening, plan)
    assert found.level is Hold.OUTSIDE
