"""Motion verdict, Poincaré points and phase portraits of recorded dwells."""

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.analysis import analyse
from vibench.analysis.chaos.verdict import MotionKind
from vibench.analysis.report._dwells import portraits_figure


@pytest.fixture(scope="module")
def analyses(dwell_file):
    return {level: analyse(open_recording(dwell_file(level))) for level in ("weak", "strong")}


@pytest.mark.thorough
def test_a_weak_dwell_is_periodic_with_the_drive_and_a_colliding_dwell_is_not(analyses):
    weak, strong = analyses["weak"].motion.verdict, analyses["strong"].motion.verdict
    assert (weak.kind, weak.period) == (MotionKind.PERIODIC, 1), weak.why
    assert strong.kind in {MotionKind.CHAOTIC, MotionKind.UNDECIDED}
    assert strong.evidence.spread > 50 * weak.evidence.spread


@pytest.mark.thorough
def test_only_a_periodic_dwell_is_tested_for_a_drift_of_its_response(analyses):
    tested = {level for level, found in analyses.items() if "Dwell settled" in {c.what for c in found.checks}}
    assert tested == {"weak"}


@pytest.mark.thorough
def test_every_drive_period_gives_one_poincare_point_on_the_orbit(analyses):
    section = analyses["weak"].motion.section
    assert np.diff(section.time_s) == pytest.approx(1 / 260.0, rel=1e-4)
    orbit = np.column_stack((section.orbit_displacement_m, section.orbit_velocity_m_per_s / 1634))
    points = np.column_stack((section.displacement_m, section.velocity_m_per_s / 1634))
    nearest = [np.min(np.linalg.norm(orbit - point, axis=1)) for point in points[::50]]
    # With about 30 samples per period, the nearest sample is within 1/60 period.
    assert max(nearest) < 0.06 * np.max(np.abs(section.orbit_displacement_m))


def test_the_phase_portraits_state_the_verdict_and_tabulate_the_points(analyses):
    drawn = portraits_figure(list(analyses.values()))
    assert drawn.png.startswith(b"\x89PNG")
    for analysis, each in zip(analyses.values(), drawn.tables, strict=True):
        assert analysis.motion.verdict.why in drawn.caption
        assert each.column("displacement_m") == pytest.approx(analysis.motion.section.displacement_m)
