"""From averaged spectra of drive x, response y and reference r to response over drive."""

import numpy as np

from ..errors import InvalidRequest
from ..signals.arrays import Complexes, Reals
from .results import Estimator


def named_estimator(estimator: Estimator | str) -> Estimator:
    """Turn a name into an estimator; raises InvalidRequest when no estimator has that name."""
    try:
        return Estimator(estimator)
    except ValueError as unknown:
        raise InvalidRequest(
            f"estimator {estimator!r} is not known; use one of {', '.join(Estimator)}"
        ) from unknown


def coherence(s_xx: Reals, s_yy: Reals, s_xy: Complexes) -> Reals:
    """|S_xy|^2 / (S_xx S_yy), 0 where a channel is dead."""
    power = s_xx * s_yy
    ratio = np.divide(np.abs(s_xy) ** 2, power, out=np.zeros_like(power), where=power > 0)
    return np.asarray(np.clip(ratio, 0.0, 1.0))


def h1(s_xx: Reals, s_xy: Complexes) -> Complexes:
    """S_xy / S_xx."""
    return _ratio(s_xy, s_xx.astype(np.complex128))


def h2(s_yy: Reals, s_xy: Complexes) -> Complexes:
    """S_yy / conj(S_xy)."""
    return _ratio(s_yy.astype(np.complex128), np.conj(s_xy))


def hv(s_xx: Reals, s_yy: Reals, s_xy: Complexes, noise_ratio: float) -> Complexes:
    """Total least squares with r = S_nn / S_mm, response noise over drive noise, in the channels' units.

    [S_yy - r S_xx + sqrt((S_yy - r S_xx)^2 + 4 r |S_xy|^2)] / (2 conj(S_xy)); r to infinity is h1, r = 0
    is h2. Without r the answer would depend on the units of the channels.
    """
    difference = s_yy - noise_ratio * s_xx
    root = np.sqrt(difference**2 + 4 * noise_ratio * np.abs(s_xy) ** 2)
    # Where the difference is negative the sum cancels; the conjugate form of the quadratic does not.
    stable = np.divide(
        4 * noise_ratio * np.abs(s_xy) ** 2,
        root - difference,
        out=np.zeros_like(root),
        where=(root - difference) > 0,
    )
    numerator = np.where(difference > 0, difference + root, stable)
    return _ratio(numerator.astype(np.complex128), 2 * np.conj(s_xy))


def least_squares(
    estimator: Estimator, s_xx: Reals, s_yy: Reals, s_xy: Complexes, noise_ratio: float | None
) -> Complexes:
    """h1, h2 or hv by its name.

    Raises InvalidRequest for the drive-referenced estimator, which needs a third channel, and for hv without
    its ratio.
    """
    match estimator, noise_ratio:
        case Estimator.H1, _:
            return h1(s_xx, s_xy)
        case Estimator.H2, _:
            return h2(s_yy, s_xy)
        case Estimator.HV, float(ratio):
            return hv(s_xx, s_yy, s_xy, ratio)
        case _:
            raise InvalidRequest(
                f"{estimator.value} is not made of two channels alone; use h1, h2, or hv with a noise ratio"
            )


def drive_referenced(s_rx: Complexes, s_ry: Complexes) -> Complexes:
    """S_ry / S_rx: the reference acts as an instrument, noise on x and y averages out."""
    return _ratio(s_ry, s_rx)


def drive_referenced_relative_sd(products: Complexes, value: Complexes, n_eff: float) -> Reals:
    """Relative standard deviation of the drive-referenced estimate.

    Var(H) = S_vv S_rr / (n |S_rx|^2) with the residual v = y - H x (instrumental variables; Wellstead
    1981, Automatica 17, 669-673), half of it in each of magnitude and phase.

    Parameters
    ----------
    products
        Averaged products of x, y, r in this order, shape (3, 3, lines), any common scale.
    value
        The estimate H, shape (lines,).
    n_eff
        Independent averages.

    """
    s_xx, s_yy, s_rr = (products[i, i].real for i in range(3))
    s_xy, s_rx = products[0, 1], products[2, 0]
    magnitude2 = np.abs(value) ** 2
    residual = np.maximum(s_yy - 2 * np.real(np.conj(value) * s_xy) + magnitude2 * s_xx, 0.0)
    bottom = 2 * n_eff * magnitude2 * np.abs(s_rx) ** 2
    variance = np.divide(residual * s_rr, bottom, out=np.full_like(bottom, np.inf), where=bottom > 0)
    return np.asarray(np.sqrt(variance))


def _ratio(numerator: Complexes, denominator: Complexes) -> Complexes:
    """Divide; a line without any drive has no transmission and gives NaN."""
    missing = np.full_like(numerator, complex(np.nan, np.nan))
    return np.asarray(np.divide(numerator, denominator, out=missing, where=denominator != 0))
