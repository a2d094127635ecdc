"""Linear law of a controller: a Kalman filter of the sampled plant, and feedback of its estimate.

A law of two gains serves controllers that cannot run this law. Multipliers of plant and law together show
whether a motion is stable.
"""

from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, expm, solve_discrete_are, solve_discrete_lyapunov
from scipy.optimize import fmin

from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker
from vibench.sim.specimen.specimen import Floats, Specimen

TABLE_V, M0_X = 1, 3
"""Row numbers of table velocity and m0 displacement in the state of table and specimen."""
SHOWN = 2
"""Number of measured quantities: base acceleration and m0 velocity."""


@dataclass(frozen=True)
class LoopTiming:
    """Sample rate and latency of a real-time controller."""

    rate_hz: float
    """Samples per second; each sample is the mean since the previous sample."""
    latency_s: float
    """Time from a sample to the output of the voltage that the sample determines [s]."""

    def __post_init__(self) -> None:
        if not (0.0 < self.rate_hz < np.inf and 0.0 <= self.latency_s < np.inf):
            raise ValueError(
                f"{self.rate_hz} samples a second, latency {self.latency_s} s: give positive, finite numbers."
            )

    @property
    def step_s(self) -> float:
        """Time between two samples of the controller [s]."""
        return 1.0 / self.rate_hz


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """Discrete-time model of the plant over one control step.

    The state contains the table (displacement, velocity, current), the specimen (x, y, z and velocities), the
    last samples (table velocity, m0 displacement), and the delayed voltages, newest first.
    """

    amplifier: Amplifier
    """Amplifier; its lower band edge is neglected, because it is far below the drive frequency."""
    shaker: Shaker
    specimen: Specimen
    timing: LoopTiming

    @cached_property
    def equations(self) -> tuple[Floats, Floats]:
        """System matrix of table and specimen, (9, 9), and effect of one volt at the amplifier, (9,)."""
        table = self.shaker.equations()
        specimen, mass = self.specimen, np.asarray(self.specimen.masses)
        k0, c0 = specimen.stiffnesses[0], specimen.dampings[0]
        rates = block_diag(table.A, np.zeros((6, 6)))
        rates[3:6, 6:9] = np.eye(3)
        rates[6:9, 3:6] = -specimen.stiffness_matrix / mass[:, None]
        rates[6:9, 6:9] = -specimen.damping_matrix / mass[:, None]
        rates[6, 0] += k0 / mass[0]
        rates[6, 1] += c0 / mass[0]
        push = table.B[:, 1]
        rates[:3, 0] -= k0 * push
        rates[:3, 1] -= c0 * push
        rates[:3, 3] += k0 * push
        rates[:3, 6] += c0 * push
        return rates, np.append(self.amplifier.gain * table.B[:, 0], np.zeros(6))

    @cached_property
    def spring(self) -> tuple[Floats, Floats]:
        """Effect of a force between m1 and m2 on the state's rates, and the row that gives p, (n,) each."""
        into, relative = np.zeros(self.size), np.zeros(self.size)
        into[7], into[8] = -1.0 / self.specimen.masses[1], 1.0 / self.specimen.masses[2]
        relative[4], relative[5] = 1.0, -1.0
        return into, relative

    @property
    def waiting(self) -> int:
        """Number of delayed voltages in the state."""
        return ceil(self.timing.latency_s * self.timing.rate_hz * (1.0 - 1e-9))

    @property
    def size(self) -> int:
        """Number of entries in the state vector."""
        return 9 + SHOWN + self.waiting

    @cached_property
    def scales(self) -> Floats:
        """Typical sizes of the state's entries for motions of micrometres, shape (n,)."""
        specimen = [1e-6] * 3 + [1e-3] * 3
        return np.array([1e-6, 1e-3, 1e-2, *specimen, 1e-3, 1e-6, *[1e-2] * self.waiting])

    def stretches(self, parts: int = 1) -> tuple[tuple[Floats, Floats], ...]:
        """Return the transitions over a step, which is divided at the middle of each part.

        Each transition is a pair: the state transition, (n, n), and the effect of the new voltage, (n,). The
        force of the stops acts at the divisions (Strang splitting).
        """
        step, size = self.timing.step_s, self.size
        sampled = np.eye(size)
        sampled[9:11] = np.eye(size)[[TABLE_V, M0_X]]
        moved_on, newest = np.eye(size), np.zeros(size)
        moved_on[11:] = np.eye(size)[10 : size - 1]
        if self.waiting:
            moved_on[11] = 0.0
            newest[11] = 1.0
        edges = step / parts * np.array([0.0, *(np.arange(parts) + 0.5), parts])
        found = [self._stretch(*each) for each in pairwise(edges)]
        found[0] = found[0][0] @ sampled, found[0][1]
        found[-1] = moved_on @ found[-1][0], moved_on @ found[-1][1] + newest
        return tuple(found)

    @cached_property
    def step(self) -> tuple[Floats, Floats]:
        """Transition over a whole step: matrix of the state (n, n), and effect of the new voltage (n,)."""
        (first, volt), (second, more) = self.stretches()
        return second @ first, second @ volt + more

    @cached_property
    def sensing(self) -> Floats:
        """Matrix for base acceleration and m0 velocity, as means since the last sample, shape (2, n)."""
        rows = np.zeros((SHOWN, self.size))
        rows[0, [TABLE_V, 9]] = self.timing.rate_hz, -self.timing.rate_hz
        rows[1, [M0_X, 10]] = self.timing.rate_hz, -self.timing.rate_hz
        return rows

    def _stretch(self, start_s: float, stop_s: float) -> tuple[Floats, Floats]:
        """Return the transition over a part of a step: the oldest delayed voltage acts, then the next."""
        late_s = self.timing.latency_s - max(self.waiting - 1, 0) * self.timing.step_s
        change_s = min(max(late_s, start_s), stop_s)
        matrix, newest = np.eye(self.size), np.zeros(self.size)
        # Delayed voltages are ordered from newest to oldest; the new voltage comes before the list.
        columns = [*range(11, self.size)][::-1]
        for place, (begin_s, end_s) in enumerate(((start_s, change_s), (change_s, stop_s))):
            moved, gain = _discretise(*self.equations, end_s - begin_s)
            matrix[:9], newest[:9] = moved @ matrix[:9], moved @ newest[:9]
            if place < len(columns):
                matrix[:9, columns[place]] += gain
            else:
                newest[:9] += gain
        return matrix, newest


def _discretise(rates: Floats, volts: Floats, length_s: float) -> tuple[Floats, Floats]:
    joint = np.zeros((len(volts) + 1, len(volts) + 1))
    joint[:-1, :-1], joint[:-1, -1] = rates * length_s, volts * length_s
    moved = expm(joint)
    return moved[:-1, :-1], moved[:-1, -1]


# Weights of the design: expected sizes of motion, voltage and noise.
RELATIVE_M = 3e-5
"""Displacement p [m] that has the same cost in the design of the law as a control voltage of 0.1 V."""
PUSH_N = 3e-3
"""Unknown force between m1 and m2 that the filter assumes, rms over a step [N]."""
VOLT = 1e-2
"""Unknown voltage that the filter assumes, rms [V]."""
NOISE = 0.2, 1e-4
"""Noise per sample of the base acceleration [m/s2] and of the m0 velocity [m/s], rms."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """Voltage u from samples s: u = output @ memory + direct @ s. Then memory = step @ memory + inlet @ s."""

    step: Floats
    """Matrix that maps the memory to its next state, shape (n, n)."""
    inlet: Floats
    """Matrix that maps the samples to the next state, shape (n, 2), per m/s2 of the base and m/s of m0."""
    output: Floats
    """Matrix that maps the memory to the output voltage, shape (1, n) [V]."""
    direct: Floats
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

    def law(unknowns: Floats) -> LinearLaw:
        share = step_s / (abs(unknowns[2]) / omega + step_s)
        kp, kd = size * unknowns[0], size * unknowns[1] / omega
        inlet, direct = np.zeros((2, 2)), np.zeros((1, 2))
        inlet[:, sample], direct[0, sample] = (share / step_s, 1.0), -kp - kd * share / step_s
        rate = np.array([[1.0 - share, -share / step_s]])
        return LinearLaw(np.vstack([rate, np.zeros((1, 2))]), inlet, -kd * rate, direct)

    start = np.array([[0.0, 0.0, 1.0], [-0.1, 0.0, 1.0], [0.0, -0.1, 1.0], [0.0, 0.0, 2.0]])

    def cost(unknowns: Floats) -> float:
        return _expected_cost(problem, law(unknowns))

    return law(np.asarray(fmin(cost, start[0], xtol=1e-3, ftol=1e-12, initial_simplex=start, disp=False)))


class _WeightedPlant(NamedTuple):
    """A plant in units of its typical motions, with the matrices of cost and noise."""

    step: Floats
    volt: Floats
    sensing: Floats
    cost: Floats
    unknown: Floats
    noise: Floats


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


def _tables_of_step(plant: SampledPlant, law: LinearLaw, parts: int) -> list[Floats]:
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
