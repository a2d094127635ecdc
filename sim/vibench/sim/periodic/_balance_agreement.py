"""Does a harmonic balance agree with the integrated motion? SI units.

Two questions, for they have different answers: is the motion one that the exact flow repeats, and is it
the one at which a run from rest arrives? A motion can be real and still not be reached.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..model import Accuracy, AccuracyWord, Harmonic, Outcome, Specimen, chosen
from ..motion import integrate, state_scales, steady_response
from ._harmonic_balance import Balance, BalanceEnd


class Agreement(StrEnum):
    """What integration says of a harmonic balance."""

    AGREES = "a run from rest settles to this motion"
    ELSEWHERE = "the motion is real, but a run from rest settles to another: compare branches and stability"
    NOT_A_MOTION = "the exact flow does not repeat this motion: allow more harmonics"
    NOT_CONVERGED = "the harmonic balance itself did not converge"
    NO_INTEGRATION = "the integrated motion was lost"


@dataclass(frozen=True)
class BalanceCheck:
    """A verdict with its numbers."""

    agreement: Agreement
    defect: float
    """How far one exact period takes the motion from itself, over the gap and gap times 2 pi f."""
    response_ii_ratio: float
    """Response II of m0: harmonic balance over integration from rest."""


def check_balance(
    specimen: Specimen,
    found: Balance,
    tolerance: float = 0.01,
    accuracy: Accuracy | AccuracyWord = Accuracy.STANDARD,
    duration_s: float = 10.0,
) -> BalanceCheck:
    """Compare a harmonic balance of a specimen with integration.

    Parameters
    ----------
    specimen
        The one whose structure and stops were balanced.
    found
        Its result.
    tolerance
        Largest defect, and largest relative difference of Response II, that count as agreement.
    accuracy, duration_s
        Of the run from rest; its last half is compared.

    """
    accuracy = chosen(Accuracy, accuracy)
    drive = Harmonic(found.frequency_hz, found.amplitude_m)
    period = integrate(specimen, drive, 1.0 / drive.frequency_hz, accuracy, found.state)
    defect = float(np.abs((period.final_state - found.state) / state_scales(specimen, drive)).max())
    settled = steady_response(specimen, drive, accuracy, duration_s=duration_s, window_s=0.5 * duration_s)
    if {period.outcome, settled.outcome} != {Outcome.REACHED_END}:
        return BalanceCheck(Agreement.NO_INTEGRATION, defect, float("nan"))
    ratio = float(found.response_ii[0] / settled.response_ii)
    if found.outcome is not BalanceEnd.CONVERGED:
        return BalanceCheck(Agreement.NOT_CONVERGED, defect, ratio)
    if not defect <= tolerance:
        return BalanceCheck(Agreement.NOT_A_MOTION, defect, ratio)
    reached = abs(ratio - 1.0) <= tolerance
    return BalanceCheck(Agreement.AGREES if reached else Agreement.ELSEWHERE, defect, ratio)
