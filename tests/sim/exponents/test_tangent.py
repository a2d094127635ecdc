"""The tangent of the flow, computed with a run, matches differences of runs and mechanics."""

import numpy as np
import pytest

from vibench.sim import Accuracy, Harmonic, Outcome, gong2025, integrate
from vibench.sim.engine.run import NativeRun, RunRecord

DRIVE = Harmonic(130.0, 20e-6)
DURATION_S = 0.02
ELASTIC = ["hertz", "linear_gap", "linear", "power:5", "power:3+5+7", "power:47", "rigid:1"]
GAPS = [45e-6, (30e-6, 45e-6), (20e-6, np.inf)]
SCALES = np.repeat([1e-4, 0.1], 3)


def run_with_tangent(specimen, accuracy=Accuracy.REFERENCE, duration_s=DURATION_S, drive=DRIVE):
    """Return the scaled derivative of the flow from rest, the final state and the number of impacts."""
    run, record = NativeRun(specimen, drive, np.zeros(6), accuracy.tolerance), RunRecord(10_000)
    run.carry(np.eye(6))
    assert run.advance(duration_s, record) is Outcome.REACHED_END
    derivative = (np.exp(run.growth)[:, None] * run.changes).T
    return derivative * SCALES / SCALES[:, None], run.motion, record.impacts


def by_differences(specimen, step, accuracy=Accuracy.REFERENCE):
    """Return the scaled derivative of the flow by central differences of runs."""
    columns = []
    for push in np.diag(step * SCALES):
        ends = [
            integrate(specimen, DRIVE, DURATION_S, accuracy, sign * push).final_state for sign in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * step * SCALES))
    return np.array(columns).T


@pytest.mark.thorough
@pytest.mark.parametrize("gap_m", GAPS)
@pytest.mark.parametrize("contact", [*ELASTIC, "hunt_crossley:0.5", "rigid:0.8"])
def test_finite_differences_converge_to_the_tangent_map(contact, gap_m):
    specimen = gong2025(contact=contact, gap_m=gap_m)
    tangent, _, impacts = run_with_tangent(specimen)
    assert impacts > 2 or not specimen.contact.kind.startswith(("hertz", "hunt"))
    size = np.abs(tangent).max()
    far, near = (np.abs(by_differences(specimen, step) - tangent).max() / size for step in (1e-5, 2.5e-6))
    assert near < 1e-5
    assert near < 0.15 * far or near < 5e-6


@pytest.mark.parametrize("contact", ELASTIC)
def test_the_volume_in_phase_space_shrinks_by_the_damping_alone(contact):
    # Liouville: elastic forces do not contribute to the divergence of the flow.
    specimen = gong2025(contact=contact)
    tangent, _, _ = run_with_tangent(specimen)
    rate = -np.trace(np.linalg.solve(specimen.mass_matrix, specimen.damping_matrix))
    sign, logarithm = np.linalg.slogdet(tangent)
    assert sign == 1.0
    assert logarithm / DURATION_S == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("contact", ["hertz", "linear_gap", "power:7", "rigid:1"])
def test_the_tangent_map_without_damping_is_symplectic(contact):
    # D' J D = J holds for displacements and momenta; here velocities are scaled by the masses.
    specimen = gong2025(damping_time_s=0.0, contact=contact)
    tangent, _, _ = run_with_tangent(specimen)
    masses = np.diag(specimen.masses) / max(specimen.masses)
    form = np.block([[np.zeros((3, 3)), masses], [-masses, np.zeros((3, 3))]])
    np.testing.assert_allclose(tangent.T @ form @ tangent, form, atol=1e-8 * np.abs(tangent).max() ** 2)


@pytest.mark.parametrize("contact", ["hertz", "power:29"])
def test_computing_the_tangent_map_does_not_change_the_motion(contact):
    specimen = gong2025(contact=contact)
    _, carried, _ = run_with_tangent(specimen, Accuracy.STANDARD, 0.3)
    plain = integrate(specimen, DRIVE, 0.3, Accuracy.STANDARD)
    np.testing.assert_array_equal(carried, plain.final_state)


@pytest.mark.parametrize("contact", ["hertz", "power:7"])
def test_a_higher_accuracy_level_gives_a_tangent_map_closer_to_the_reference(contact):
    specimen = gong2025(contact=contact)
    found = {level: run_with_tangent(specimen, level, 0.2)[0] for level in Accuracy}
    size = np.abs(found[Accuracy.REFERENCE]).max()
    quick, standard = (
        np.abs(found[level] - found[Accuracy.REFERENCE]).max() / size
        for level in (Accuracy.QUICK, Accuracy.STANDARD)
    )
    assert standard < 1e-2
    assert quick < 0.1
    if contact == "hertz":
        # Hertz collisions are solved more accurately than requested, so quick is as good as standard.
        assert max(quick, standard) < 2e-4
    else:
        assert standard < 0.2 * quick


def test_an_impact_shrinks_the_volume_in_phase_space_by_the_square_of_the_restitution():
    specimen = gong2025(contact="rigid:0.8")
    tangent, _, impacts = run_with_tangent(specimen)
    rate = -np.trace(np.linalg.solve(specimen.mass_matrix, specimen.damping_matrix))
    assert impacts > 2
    expected = rate * DURATION_S + 2.0 * impacts * np.log(0.8)
    assert np.linalg.slogdet(tangent)[1] == pytest.approx(expected, rel=1e-6)
