"""Notes of a fast loop about a branch, as numbers and sentences."""

import numpy as np

from vibench.acquisition.recording import BranchPointNote, BranchStabilityNote, Stability
from vibench_fast_loop.held_branch import branch_sentences, held_branch

HERTZ = 94.0, 95.0, 94.6, 94.2


def point(number, hertz):
    return BranchPointNote(
        point=number, frequency_hz=hertz, base_m=3e-6, m0_m=9e-6, phase_deg=-90.0, residue=0.002,
        residue_acceleration=0.02, reference_v=0.1, tries=2,
    )  # fmt: skip


def note(number, stability, multiplier):
    return BranchStabilityNote(
        point=number, stability=stability, multiplier=multiplier,
        multiplier_u=None if multiplier is None else 0.01, perturbation=0.02, moved=1e-4,
    )  # fmt: skip


POINTS = [point(number, hertz) for number, hertz in enumerate(HERTZ)]


def test_notes_on_stability_are_assigned_to_their_points_in_any_order():
    # Point 2 gave no result, and the run ended before point 3 was tested.
    notes = [note(1, Stability.STABLE, 0.96), note(0, Stability.UNSTABLE, 1.1), note(2, Stability.OPEN, None)]
    found = held_branch([*POINTS, *notes])
    assert found.stability == ("unstable", "stable", "not determined", "")
    np.testing.assert_array_equal(found.multiplier, [1.1, 0.96, np.nan, np.nan])
    np.testing.assert_array_equal(found.multiplier_u, [0.01, 0.01, np.nan, np.nan])
    said = branch_sentences([*POINTS, *notes])
    wanted = "Without feedback, the motions are 1 stable, 1 unstable, 1 not determined"
    assert any(each.startswith(wanted) for each in said), said


def test_a_branch_measured_without_perturbations_has_no_stability_verdict():
    assert held_branch(POINTS).stability == ("",) * 4
    assert not any("Without feedback" in each for each in branch_sentences(POINTS))
    assert held_branch([]).multiplier.size == 0
