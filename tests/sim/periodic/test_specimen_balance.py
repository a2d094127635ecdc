import pytest

from vibench.sim import Harmonic, gong2025, steady_response
from vibench.sim.periodic._balance_branch import balance_specimen
from vibench.sim.periodic._balance_solver import BalanceOptions
from vibench.sim.periodic._harmonic_balance import BalanceEnd

SPECIMEN = gong2025(damping_time_s=3e-5)


@pytest.mark.parametrize(("frequency_hz", "amplitude_m"), [(60.0, 5e-6), (100.0, 5e-6), (130.0, 20e-6)])
def test_harmonic_balance_gives_the_responses_of_integration(frequency_hz, amplitude_m):
    drive = Harmonic(frequency_hz, amplitude_m)
    found = balance_specimen(SPECIMEN, drive)
    settled = steady_response(SPECIMEN, drive, duration_s=6.0, window_s=2.0)
    assert found.outcome is BalanceEnd.CONVERGED
    assert found.response_i[0] == pytest.approx(settled.response_i, rel=1e-4)
    assert found.response_ii[0] == pytest.approx(settled.response_ii, rel=1e-4)
    assert found.response_i[3] == pytest.approx(settled.relative_i, rel=1e-4)


def test_what_has_not_converged_says_so():
    # Chaos at 260 Hz and 5 um, with no more than 31 harmonics: whatever is found is not called a solution.
    found = balance_specimen(SPECIMEN, Harmonic(260.0, 5e-6), BalanceOptions(fewest=15, most=31))
    assert found.outcome is not BalanceEnd.CONVERGED


def test_a_drive_with_a_phase_is_refused():
    with pytest.raises(ValueError, match="phase zero"):
        balance_specimen(SPECIMEN, Harmonic(100.0, 5e-6, 0.3))
