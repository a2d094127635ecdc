"""Linear law of a controller: a Kalman filter of the sampled plant, and feedback of its estimate.

A law of two gains serves controllers that cannot run this law. Multipliers of plant and law together show
whether a motion is stable.
"""

from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov
from scipy.optimize import fmin

from vibench.sim.specimen.state import Table, Vector

from .plant import SampledPlant

# Weights of the design: expected sizes of motion, voltage and noise.
RELATIVE_M = 3e-5
"""Displacement p [m] that costs as much in the design of the law as a control voltage of 0.1 V."""
PUSH_N = 3e-3
"""Unknown force between m1 and m2 that the filter assumes, rms over a step [N]."""
VOLT = 1e-2
"""Unknown voltage that the filter assumes, rms [V]."""
NOISE = 0.2, 1e-4
"""Noise per sample of the base acceleration [m/s2] and of the m0 velocity [m/s], rms."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """Voltage u from samples s: u = output @ memory + direct @ s. Then memory = step @ memory + inlet @ s."""

    step: Table
    """Matrix that maps the memory to its next state, shape (n, n)."""
    inlet: Table
    """Matrix that maps the samples to the next state, shape (n, 2), per m/s2 of the base and m/s of m0."""
    output: Table
    """Matrix that maps the memory to the output voltage, shape (1, n) [V]."""
    direct: Table
    """Matrix that maps the samples to the output, shape (1, 2), volts per m/s2 of the base and m/s of m0."""


def design_law(plant: SampledPlant) -> LinearLaw:
    """Return the law that damps the spring between m1 and m2, and accounts for the latency of ``plant``.

    Linear-quadratic Gaussian control (Franklin, Powell and Workman, Digital Control of Dynamic Systems, ch.
    9). The estimate includes the present sample.
    """
    step, volt, shown, cost, unknown, noise = _weigh(plant)
    value = solve_discrete_are(step, volt[:, None], cost, np.eye(1))
    gain = (volt @ value @ step)[None, :] / (1.0 + volt @ value @ volt)
    covariance = solve_discrete_are(step.T, shown.T, unknown + 1e-12 * np.eye(plant.size), noise)
    filtered = np.linalg.solve(shown @ covariance @ shown.T + noise, shown @ covariance).T
    kept = np.eye(plant.size) - filtered @ shown
    closed = step - volt[:, None] @ gain
    return LinearLaw(closed @ kept, closed @ filtered, -gain @ kept, -gain @ filtered)


def pd_law(plant: SampledPlant, sample: int) -> LinearLaw:
    """Return the two-gain law with the lowest cost (see `design_law`), for controllers that allow no other.

    ``u = -(kp s + kd d)`` for one sample s and its low-pass filtered rate ``d += a ((s - before) / step -
    d)``, where ``a = step / (tau + step)``. Gains and tau minimise the expected cost (W. S. Levine and M.
    Athans, IEEE Trans. Autom. Control 15 (1970) 44). ``sample`` is the index of the sample that is fed back:
    0 for base acceleration, 1 for m0 velocity.
    """
    problem, step_s = _weigh(plant), plant.timing.step_s
    omega = 2 * np.pi * plant.specimen.natural_frequencies_hz[0]
    size = 0.1 / RELATIVE_M / omega ** (2 - sample)

    def law(unknowns: Vector) -> LinearLaw:
        share = step_s / (abs(unknowns[2]) / omega + step_s)
        kp, kd = size * unknowns[0], size * unknowns[1] / omega
        inlet, direct = np.zeros((2, 2)), np.zeros((1, 2))
        inlet[:, sample], direct[0, sample] = (share / step_s, 1.0), -kp - kd * share / step_s
        rate = np.array([[1.0 - share, -share / step_s]])
        return LinearLaw(np.vstack([rate, np.zeros((1, 2))]), inlet, -kd * rate, direct)

    start = np.array([[0.0, 0.0, 1.0], [-0.1, 0.0, 1.0], [0.0, -0.1, 1.0], [0.0, 0.0, 2.0]])

    def cost(unknowns: Vector) -> float:
        return _expected_cost(problem, law(unknowns))

    return law(np.asarray(fmin(cost, start[0], xtol=1e-3, ftol=1e-12, initial_simplex=start, disp=False)))


class _WeightedPlant(NamedTuple):
    """A plant in units of its typical motions, with the matrices of cost and noise."""

    step: Table
    volt: Vector
    sensing: Table
    cost: Table
    unknown: Table
    noise: Table


def _weigh(plant: SampledPlant) -> _WeightedPlant:
    scale = plant.scales
    step, volt = plant.step
    step = step * scale / scale[:, None]
    volt = volt / scale
    into, relative = (each * factor for each, factor in zip(plant.spring, (1 / scale, scale), strict=True))
    fast = np.zeros(plant.size)
    omega = 2 * np.pi * plant.specimen.natural_frequencies_hz[0]
    fast[7], fast[8] = scale[7] / omega, -scale[8] / omega
    cost = (np.outer(relative, relative) + np.outer(fast, fast)) * (0.1 / RELATIVE_M) ** 2
    pushed = step @ into * plant.timing.step_s
    unknown = np.outer(pushed, pushed) * PUSH_N**2 + np.outer(volt, volt) * VOLT**2
    noise = np.diag(np.square(NOISE))
    return _WeightedPlant(step, volt, plant.sensing * scale, cost, unknown, noise)


def _expected_cost(problem: _WeightedPlant, law: LinearLaw) -> float:
    """Return the mean cost per sample under noise; infinite if the loop is unstable."""
    answer = np.hstack([law.direct @ problem.sensing, law.output])[0]
    own = len(problem.step)
    closed = np.vstack([np.zeros((own, len(answer))), np.hstack([law.inlet @ problem.sensing, law.step])])
    closed[:own, :own] = problem.step
    closed[:own] += np.outer(problem.volt, answer)
    if np.abs(np.linalg.eigvals(closed)).max() >= 1.0:
        return float("inf")
    heard = np.vstack([np.outer(problem.volt, law.direct), law.inlet])
    noise = heard @ problem.noise @ heard.T
    noise[:own, :own] += problem.unknown
    covariance = solve_discrete_lyapunov(closed, noise)
    direct = (law.direct @ problem.noise @ law.direct.T).item()
    return float(np.trace(covariance[:own, :own] @ problem.cost) + answer @ covariance @ answer + direct)


def loop_multiplier(
    plant: SampledPlant,
    law: LinearLaw,
    stiffness: ArrayLike,
    damping: ArrayLike = 0.0,
    periods: int = 1,
    parts: int = 1,
) -> float:
    """Return the largest multiplier of a motion over a period under a law; below 1, the motion is held.

    Parameters
    ----------
    plant
        The plant that is driven; it may differ from the plant for which the law was designed.
    law
        A law, designed for this or another latency.
    stiffness, damping
        Slopes dF/dp [N/m] and dF/d(dp/dt) [N s/m] of the stops' force along the motion, at the middle of each
        part of each sample, shape (samples * parts,).
    periods
        Number of periods covered by the slopes; together they contain a (nearly) whole number of samples.
    parts
        Number of parts per sample; contacts are shorter than a sample.
    """
    stretches = _tables_of_step(plant, law, parts)
    into, relative = (np.pad(each, (0, len(stretches[0]) - plant.size)) for each in plant.spring)
    rate, part_s = np.roll(relative, 3), plant.timing.step_s / parts
    springs, dampers = np.broadcast_arrays(stiffness, damping)
    free = reduce(lambda before, stretch: stretch @ before, stretches)
    moved = np.eye(len(free))
    for spring, damper in zip(springs.reshape(-1, parts), dampers.reshape(-1, parts), strict=True):
        if not spring.any():
            moved = free @ moved
            continue
        pulls = part_s * (np.outer(spring, relative) + np.outer(damper, rate))
        for stretch, pull in zip(stretches, pulls, strict=False):
            moved = stretch @ moved
            moved += np.outer(into, pull @ moved)
        moved = stretches[-1] @ moved
    return float(np.abs(np.linalg.eigvals(moved)).max() ** (1.0 / periods))


def loop_transfer(plant: SampledPlant, law: LinearLaw, frequency_hz: float) -> complex:
    """Return the base displacement per volt of the program, with the law active [m/V].

    Phases refer to the sample times; the stops are neglected.
    """
    before, after = _tables_of_step(plant, law, 1)
    played = np.concatenate([plant.stretches()[0][1], np.zeros(len(law.step)), [1.0]])
    turn = np.exp(2j * np.pi * frequency_hz * plant.timing.step_s)
    return complex(np.linalg.solve(turn * np.eye(len(before)) - after @ before, after @ played)[0])


def _tables_of_step(plant: SampledPlant, law: LinearLaw, parts: int) -> list[Table]:
    """Return the matrices of the sections of a step; the state consists of plant, law memory and voltage."""
    own, memory = plant.size, len(law.step)
    answer = np.hstack([law.direct @ plant.sensing, law.output])
    (first, of_first), *others = plant.stretches(parts)
    begin = np.zeros((own + memory + 1, own + memory + 1))
    begin[:own, :own], begin[own:-1, :own], begin[own:-1, own:-1] = first, law.inlet @ plant.sensing, law.step
    begin[:own, :-1] += np.outer(of_first, answer)
    begin[-1, :-1] = answer[0]
    joined = [begin]
    for stretch, of_volt in others:
        joined.append(np.eye(own + memory + 1))
        joined[-1][:own, :own], joined[-1][:own, -1] = stretch, of_volt
    return joined
