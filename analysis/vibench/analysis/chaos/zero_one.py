"""The 0-1 test for chaos: 0 for regular motion, 1 for chaotic, from one series."""

from dataclasses import dataclass

import numpy as np

from ..errors import NotEnoughData
from ..signals.arrays import Reals

_LOWEST, _HIGHEST = np.pi / 5, 4 * np.pi / 5
"""Frequencies c outside are prone to resonances (section 3.1 of the source)."""
_FREQUENCIES = 100
_CUT = 10
"""The mean square displacement is followed over this part of the series."""
FEWEST = 200
OVERSAMPLED = 0.8
"""Correlation of neighbours above which a series is a flow sampled too finely for this test."""


@dataclass(frozen=True)
class ZeroOne:
    """What the 0-1 test says."""

    k: float
    """Median of the correlations K_c: near 0 regular, near 1 chaotic *or noisy*."""
    spread: float
    """Half the distance between their quartiles."""
    neighbour_correlation: float
    """Of each value with the next."""

    @property
    def is_oversampled(self) -> bool:
        """Whether neighbours resemble each other so much that K says nothing."""
        return self.neighbour_correlation > OVERSAMPLED


def zero_one(series: Reals, *, seed: int = 0) -> ZeroOne:
    """Test a series that was taken once per drive period.

    Gottwald and Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129, the correlation method with the
    oscillatory term removed (eqs. 3.1 to 3.6). Noise passes for chaos in it, and an oversampled chaotic
    flow for regular motion: it is one witness, never the judge.

    Raises NotEnoughData when the series is too short.

    Parameters
    ----------
    series
        Shape (n,), at least 200 values.
    seed
        Of the frequencies c.

    """
    count = series.size
    if count < FEWEST:
        raise NotEnoughData(f"the 0-1 test needs {FEWEST} values and was given {count}; measure longer")
    centred = series - series.mean()
    power = float(np.mean(centred**2))
    if power == 0.0:
        return ZeroOne(0.0, 0.0, 0.0)
    neighbours = float(np.mean(centred[1:] * centred[:-1])) / power
    frequencies = np.random.default_rng(seed).uniform(_LOWEST, _HIGHEST, _FREQUENCIES)
    correlations = [_correlation(series, each) for each in frequencies]
    lower, middle, upper = np.quantile(correlations, (0.25, 0.5, 0.75))
    return ZeroOne(float(middle), float(0.5 * (upper - lower)), neighbours)


def _correlation(series: Reals, frequency: float) -> float:
    """K_c: how straight the mean square displacement of the translated motion grows."""
    count = series.size
    cut = count // _CUT
    walk = np.cumsum(series * np.exp(1j * frequency * np.arange(1, count + 1)))
    lags = np.arange(1, cut + 1)
    displacement = np.array(
        [np.mean(np.abs(walk[lag : count - cut + lag] - walk[: count - cut]) ** 2) for lag in lags]
    )
    oscillation = series.mean() ** 2 * (1 - np.cos(frequency * lags)) / (1 - np.cos(frequency))
    return float(np.corrcoef(lags, displacement - oscillation)[0, 1])
