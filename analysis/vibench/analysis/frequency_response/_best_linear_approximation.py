"""The best linear approximation over realisations of a periodic drive, its noise and its distortion."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..signals import Complexes, Reals
from ._estimators import coherence


class Scatter(StrEnum):
    """What the bounds of a periodic transmission were measured from."""

    REALISATIONS = "realisations"
    """The full uncertainty: noise and nonlinear distortion."""
    PERIODS = "periods"
    """One realisation only: noise alone; a nonlinear specimen may lie outside the bounds."""


@dataclass(frozen=True)
class BestLinearApproximation:
    """Response over base at the driven lines; arrays of shape (lines,)."""

    value: Complexes
    coherence: Reals
    relative_sd: Reals
    """Standard deviation of ln(magnitude), equal to that of the phase [rad]."""
    noise_variance: Reals
    """Complex variance of one realisation's estimate that noise explains."""
    distortion_variance: Reals | None
    """What realisations scatter beyond the noise; None for a single one."""
    scatter: Scatter
    averages: int
    """Independent values the scatter was measured from: realisations, or periods of the only one."""


def best_linear_approximation(
    drive: Complexes, base: Complexes, response: Complexes, covariance: Complexes, periods: int
) -> BestLinearApproximation:
    """Form response over base, referenced to the drive, and split its scatter.

    H = sum Y U* / sum X U*, with residuals v = Y - H X; Var(H) = s_v^2 sum |U|^2 / |sum X U*|^2
    (Pintelon & Schoukens, System Identification, 2nd ed., section 4.3.2, known reference).

    Parameters
    ----------
    drive, base, response
        Spectra U, X, Y averaged over the periods of each realisation, shape (realisations, lines).
    covariance
        Of these averages of (X, Y) between periods, averaged over realisations, shape (2, 2, lines).
    periods
        Periods per realisation.

    """
    count = len(drive)
    through = np.sum(base * np.conj(drive), axis=0)
    value = np.sum(response * np.conj(drive), axis=0) / through
    to_one = count * np.sum(np.abs(drive) ** 2, axis=0) / np.abs(through) ** 2
    noise = np.maximum(
        covariance[1, 1].real
        + np.abs(value) ** 2 * covariance[0, 0].real
        - 2 * np.real(np.conj(value) * covariance[0, 1]),
        0.0,
    )
    noise_variance = to_one * noise
    if count == 1:
        signal = np.abs(value) ** 2
        return BestLinearApproximation(
            value=value,
            coherence=signal / (signal + periods * noise_variance),
            relative_sd=np.sqrt(noise_variance / 2) / np.abs(value),
            noise_variance=noise_variance,
            distortion_variance=None,
            scatter=Scatter.PERIODS,
            averages=periods,
        )
    residual = response - value * base
    variance = to_one * np.sum(np.abs(residual) ** 2, axis=0) / (count - 1)
    return BestLinearApproximation(
        value=value,
        coherence=coherence(
            np.sum(np.abs(base) ** 2, axis=0),
            np.sum(np.abs(response) ** 2, axis=0),
            np.sum(np.conj(base) * response, axis=0),
        ),
        relative_sd=np.sqrt(variance / count / 2) / np.abs(value),
        noise_variance=noise_variance,
        distortion_variance=np.maximum(variance - noise_variance, 0.0),
        scatter=Scatter.REALISATIONS,
        averages=count,
    )
