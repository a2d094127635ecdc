"""The linear law of a controller: a Kalman filter of the sampled plant, and the feedback of its estimate."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from ..kernels import Table
from ._plant import SampledPlant


@dataclass(frozen=True)
class LawWeights:
    """What a law shall weigh; sizes of motion that go with a volt."""

    relative_m: float = 3e-5
    """Motion of p that is worth a tenth of a volt of control."""
    push_n: float = 3e-3
    """Force between m1 and m2 that the filter expects without knowing it, rms over a step [N]."""
    volt: float = 1e-2
    """Unknown voltage, likewise [V]."""
    acceleration: float = 0.2
    """Noise of a sample of the base's acceleration [m/s2]."""
    velocity: float = 1e-4
    """Noise of a sample of m0's velocity [m/s]."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """Volts u of samples s: u = output @ memory + direct @ s, then memory = step @ memory + inlet @ s."""

    step: Table
    """Shape (n, n)."""
    inlet: Table
    """Shape (n, 2), per m/s2 of the base and per m/s of m0."""
    output: Table
    """Shape (1, n) [V]."""
    direct: Table
    """Shape (1, 2)."""


def designed_law(plant: SampledPlant, weights: LawWeights = LawWeights()) -> LinearLaw:
    """Design the law that takes motion out of the spring between m1 and m2.

    Linear-quadratic Gaussian (Franklin, Powell and Workman, Digital Control of Dynamic Systems, ch. 9), the
    estimate being that of the moment of the sample.

    Parameters
    ----------
    plant
        As far as it is known; the law is made for its latency.
    weights
        What is weighed.

    """
    scale = plant.scales
    step, volt = plant.step
    step = step * scale / scale[:, None]
    volt = volt / scale
    shown = plant.shown * scale
    into, relative = (each * factor for each, factor in zip(plant.spring, (1 / scale, scale), strict=True))
    fast = np.zeros(plant.size)
    omega = 2 * np.pi * plant.specimen.natural_frequencies_hz[0]
    fast[7], fast[8] = scale[7] / omega, -scale[8] / omega
    cost = (np.outer(relative, relative) + np.outer(fast, fast)) * (0.1 / weights.relative_m) ** 2
    gain = _gain(step, volt[:, None], cost, np.eye(1))
    pushed = step @ into * plant.timing.step_s
    unknown = np.outer(pushed, pushed) * weights.push_n**2 + np.outer(volt, volt) * weights.volt**2
    noise = np.diag([weights.acceleration**2, weights.velocity**2])
    covariance = solve_discrete_are(step.T, shown.T, unknown + 1e-12 * np.eye(plant.size), noise)
    filtered = np.linalg.solve(shown @ covariance @ shown.T + noise, shown @ covariance).T
    kept = np.eye(plant.size) - filtered @ shown
    closed = step - volt[:, None] @ gain
    return LinearLaw(closed @ kept, closed @ filtered, -gain @ kept, -gain @ filtered)


def _gain(step: Table, volt: Table, cost: Table, price: Table) -> Table:
    value = solve_discrete_are(step, volt, cost, price)
    return np.asarray(np.linalg.solve(price + volt.T @ value @ volt, volt.T @ value @ step))
