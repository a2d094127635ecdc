"""Lyapunov exponents of any smooth flow or map given as compiled functions: for checks and comparisons.

The same orthogonalisation and the same errors as for the specimen, so that values known from the literature
test both. A flow is followed by Dormand and Prince's order 8(5,3) in its general form, state and changes
together (Benettin et al., Meccanica 15 (1980) 9; Hairer, Norsett and Wanner, Solving Ordinary Differential
Equations I, 2nd ed. 1993).

The functions fill their last argument and are compiled by numba: ``rates(time, state, parameters, out)`` and
``jacobian(time, state, parameters, out)`` of a flow; ``image(state, parameters, out)`` of a map, which gives
how long the step took (1.0 for a map without time), and ``jacobian(state, parameters, out)``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.integrate._ivp import dop853_coefficients as _dop

from tests.sim.exponents.orthonormal import orthonormal_rows, orthonormalise
from vibench.sim.contact.contact import step_factor
from vibench.sim.contact.flow import BLEND, ERROR_3, ERROR_5, STAGES
from vibench.sim.exponents.blocking import blocked_mean
from vibench.sim.exponents.lyapunov_spectrum import kaplan_yorke
from vibench.sim.kernels.arrays import Floats, Table, Vector

Flow = Callable[[float, Vector, Vector, Vector], None]
FlowJacobian = Callable[[float, Vector, Vector, Table], None]
Image = Callable[[Vector, Vector, Vector], float]
ImageJacobian = Callable[[Vector, Vector, Table], None]

A = np.ascontiguousarray(_dop.A[:STAGES, :STAGES])
B = np.ascontiguousarray(_dop.B)
C = np.ascontiguousarray(_dop.C[:STAGES])
FIRST_STEP = 1e-3
"""Of a flow, over the time between readings."""
SMALLEST_SIZE = 1e-6
"""A component counts as at least this large, over the largest of the state."""

Kernel = TypeVar("Kernel", bound=Callable[..., object])


@dataclass(frozen=True, eq=False)
class Exponents:
    """Exponents per unit time (per step for a map without time), with their errors."""

    exponents: Floats
    """Descending but for their errors, shape (m,)."""
    standard_errors: Floats
    """Shape (m,)."""
    is_long_enough: bool
    """Every error comes from blocks longer than the memory of the motion."""
    readings: int
    duration: float
    """Time over which the mean was taken."""
    final_state: Floats

    @property
    def dimension(self) -> float:
        """Kaplan and Yorke's."""
        return kaplan_yorke(self.exponents)


def flow_exponents(
    rates: Flow,
    jacobian: FlowJacobian,
    start: ArrayLike,
    parameters: ArrayLike,
    reading: float,
    readings: int,
    settling: int = 100,
    changes: int | None = None,
    tolerance: float = 1e-9,
) -> Exponents:
    """Find the exponents of a smooth flow.

    Parameters
    ----------
    rates, jacobian
        Compiled functions, as the module says.
    start, parameters
        State at time zero, shape (n,), and what is handed to the functions, shape (any,).
    reading
        Time between orthogonalisations: about a cycle, or a drive period.
    readings, settling
        How many are averaged, and how many come before.
    changes
        Largest exponents that are wanted; all n when None.
    tolerance
        Relative error of a step.

    Raises
    ------
    ValueError
        When a number is not allowed, the flow left the finite numbers, or readings are too rare.

    """
    state = np.array(start, dtype=np.float64)
    wanted = _check(state, changes, readings, settling)
    if not (0.0 < reading < math.inf and 0.0 < tolerance < 1.0):
        msg = f"Reading {reading} with tolerance {tolerance} is not allowed: positive, and below 1."
        raise ValueError(msg)
    rows, metric = _general_rows(wanted, len(state)), np.eye(len(state))
    growth = np.zeros((settling + readings, wanted))
    par = np.asarray(parameters, dtype=np.float64)
    _follow_flow(rates, jacobian, state, rows, par, reading, tolerance, metric, growth)
    times = np.full(len(growth), reading)
    return _averaged(growth[settling:], times[settling:], state)


def map_exponents(
    image: Image,
    jacobian: ImageJacobian,
    start: ArrayLike,
    parameters: ArrayLike,
    steps: int,
    readings: int,
    settling: int = 100,
    changes: int | None = None,
) -> Exponents:
    """Find the exponents of a map, over the time that its steps take.

    Parameters
    ----------
    image, jacobian
        Compiled functions, as the module says.
    start, parameters
        State, shape (n,), and what is handed to the functions, shape (any,).
    steps
        Of the map between orthogonalisations.
    readings, settling, changes
        As in `flow_exponents`.

    Raises
    ------
    ValueError
        When a number is not allowed, the map left the finite numbers, or readings are too rare.

    """
    state = np.array(start, dtype=np.float64)
    wanted = _check(state, changes, readings, settling)
    if steps < 1:
        msg = f"{steps} steps between readings are not allowed: 1 or more."
        raise ValueError(msg)
    rows, metric = _general_rows(wanted, len(state)), np.eye(len(state))
    growth, times = np.zeros((settling + readings, wanted)), np.zeros(settling + readings)
    par = np.asarray(parameters, dtype=np.float64)
    _follow_map(image, jacobian, state, rows, par, steps, metric, growth, times)
    return _averaged(growth[settling:], times[settling:], state)


def _check(state: Floats, changes: int | None, readings: int, settling: int) -> int:
    wanted = len(state) if changes is None else changes
    if not (1 <= wanted <= len(state) and readings >= 2 and settling >= 0):
        msg = (
            f"{wanted} exponents of {len(state)} from {readings} readings after {settling} are not allowed: "
            "1 to the size of the state, from 2 or more."
        )
        raise ValueError(msg)
    return wanted


def _general_rows(count: int, size: int) -> Floats:
    general = np.cos(np.outer(np.arange(1.0, count + 1.0), np.arange(1.0, size + 1.0)))
    return orthonormal_rows(general, np.eye(size))


def _averaged(growth: Floats, times: Floats, state: Floats) -> Exponents:
    if not bool(np.all(np.isfinite(state))):
        msg = "The motion left the finite numbers: start elsewhere, or check its functions."
        raise ValueError(msg)
    if not bool(np.all(np.isfinite(growth))):
        msg = "Changes ran together between two readings: take readings more often."
        raise ValueError(msg)
    exponents = growth.sum(axis=0) / times.sum()
    # A ratio of means: its error is that of what is left of the growth when the mean is taken out.
    left = [blocked_mean(column / times.mean()) for column in (growth - np.outer(times, exponents)).T]
    return Exponents(
        exponents=exponents,
        standard_errors=np.array([each.standard_error for each in left]),
        is_long_enough=all(each.is_long_enough for each in left),
        readings=len(growth),
        duration=float(times.sum()),
        final_state=state,
    )


def _specialised(kernel: Kernel) -> Kernel:
    """Compile as `vibench.sim.kernels` does, but keep nothing on the disk: it takes functions of others."""
    return cast("Kernel", njit(nogil=True, error_model="numpy")(kernel))


@_specialised
def _fill_slopes(
    rates: Flow,
    jacobian: FlowJacobian,
    joint: Vector,
    par: Vector,
    time: float,
    step: float,
    slopes: Table,
    matrix: Table,
    argument: Vector,
) -> None:
    """Fill the twelve slopes of a step, of the state and of every change behind it."""
    size = len(matrix)
    for stage in range(STAGES):
        argument[:] = joint
        for before in range(stage):
            if A[stage, before] != 0.0:
                argument += (step * A[stage, before]) * slopes[before]
        rates(time + C[stage] * step, argument[:size], par, slopes[stage, :size])
        jacobian(time + C[stage] * step, argument[:size], par, matrix)
        for first in range(size, len(joint), size):
            for i in range(size):
                slope = 0.0
                for j in range(size):
                    slope += matrix[i, j] * argument[first + j]
                slopes[stage, first + i] = slope


@_specialised
def _step_error(slopes: Table, state: Vector, step: float, tolerance: float) -> float:
    """Error of a step of the state, over what is allowed; NaN when a stage ran away."""
    largest, fifth, third = 1e-300, 0.0, 0.0
    for value in state:
        largest = max(largest, abs(value))
    for i in range(len(state)):
        sum_5, sum_3 = 0.0, 0.0
        for stage in range(STAGES):
            sum_5 += ERROR_5[stage] * slopes[stage, i]
            sum_3 += ERROR_3[stage] * slopes[stage, i]
        allowed = tolerance * max(abs(state[i]), SMALLEST_SIZE * largest)
        fifth += (sum_5 / allowed) ** 2
        third += (sum_3 / allowed) ** 2
    blended = fifth + BLEND * third
    return step * fifth / math.sqrt(len(state) * blended) if blended != 0.0 else 0.0


@_specialised
def _follow_flow(
    rates: Flow,
    jacobian: FlowJacobian,
    state: Vector,
    rows: Table,
    par: Vector,
    reading: float,
    tolerance: float,
    metric: Table,
    growth: Table,
) -> None:
    """Fill the growth of every reading; state and rows are left where they end."""
    size = len(state)
    joint = np.concatenate((state, rows.ravel()))
    argument, slopes = np.empty(len(joint)), np.empty((STAGES, len(joint)))
    matrix, step = np.empty((size, size)), FIRST_STEP * reading
    for k in range(len(growth)):
        since = 0.0
        while since < reading:
            taken = min(step, reading - since)
            _fill_slopes(rates, jacobian, joint, par, k * reading + since, taken, slopes, matrix, argument)
            error = _step_error(slopes, joint[:size], taken, tolerance)
            factor = step_factor(error)
            if not error <= 1.0:
                step = taken * min(factor, 1.0)
                if since + step == since:
                    state[:] = math.nan
                    return
                continue
            for stage in range(STAGES):
                joint += (taken * B[stage]) * slopes[stage]
            since = reading if taken == reading - since else since + taken
            step = max(step, taken * factor) if taken < step else taken * factor
        orthonormalise(joint[size:].reshape(rows.shape), metric, growth[k])
    state[:] = joint[:size]


@_specialised
def _follow_map(
    image: Image,
    jacobian: ImageJacobian,
    state: Vector,
    rows: Table,
    par: Vector,
    steps: int,
    metric: Table,
    growth: Table,
    times: Vector,
) -> None:
    """Fill the growth and the time of every reading."""
    size = len(state)
    after, changed, matrix = np.empty(size), np.empty(size), np.empty((size, size))
    for k in range(len(growth)):
        for _ in range(steps):
            jacobian(state, par, matrix)
            times[k] += image(state, par, after)
            state[:] = after
            for change in rows:
                for i in range(size):
                    changed[i] = 0.0
                    for j in range(size):
                        changed[i] += matrix[i, j] * change[j]
                change[:] = changed
        orthonormalise(rows, metric, growth[k])
