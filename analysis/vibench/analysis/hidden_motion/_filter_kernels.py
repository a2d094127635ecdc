"""One step of the tracked motion, and the Kalman filter over many.

The state holds X, Y, Z and their rates relative to the base, the base's velocity W and the error B of the
recorded acceleration, SI; behind them deviations of the parameters that are estimated. Notation of the
equations: docs/hidden-motion.md.
"""

import numpy as np

from vibench.sim.kernels import kernel, kernel_without_refcount

from ..signals import Reals

STATES = 8
"""X, Y, Z, X', Y', Z', W, B."""
X, Y, Z, VX, VY, VZ, W, B = range(STATES)
LOWER, UPPER, STEEP, EXPONENT, SPRING, LOSS, PER_M1, PER_M2 = range(8)
"""Row of a stop: gaps at negative and positive p, K and n of K d^n, k of k d, loss, 1 / m1, 1 / m2."""
_HERTZ = 1.5
FLIGHT, TOUCHED, IN_CONTACT = range(3)
"""What a step was: without a stop, with one but free at its end, in contact at its end."""
_STEP_REACH_M = 2e-7
"""A stop that a flight passes within this distance is looked at in small steps: far below any clearance."""


@kernel_without_refcount
def _power(d: float, exponent: float) -> float:
    """Give d to an exponent; a root costs a tenth of a power."""
    return float(d * np.sqrt(d) if exponent == _HERTZ else d**exponent)


@kernel_without_refcount
def _force(p: float, rate: float, stop: Reals) -> float:
    """Force of the stops on m1, against the penetration [N]."""
    if p > stop[UPPER]:
        d = p - stop[UPPER]
        return float(
            -(stop[STEEP] * _power(d, stop[EXPONENT]) + stop[SPRING] * d) * (1.0 + stop[LOSS] * rate)
        )
    if p < -stop[LOWER]:
        d = -p - stop[LOWER]
        return float((stop[STEEP] * _power(d, stop[EXPONENT]) + stop[SPRING] * d) * (1.0 - stop[LOSS] * rate))
    return 0.0


@kernel_without_refcount
def kick(state: Reals, stop: Reals, time_s: float, jacobian: Reals) -> float:
    """Let the stops push for a while at standstill; gives the impulse on m1. Without rows no Jacobian."""
    p, rate = state[Y] - state[Z], state[VY] - state[VZ]
    force = _force(p, rate, stop)
    if force == 0.0:
        return 0.0
    if jacobian.shape[0] > 0:
        d = p - stop[UPPER] if p > 0.0 else -p - stop[LOWER]
        steep = stop[STEEP] * _power(d, stop[EXPONENT])
        sign = 1.0 if p > 0.0 else -1.0
        damped = 1.0 + sign * stop[LOSS] * rate
        by_p = -(stop[EXPONENT] * steep / d + stop[SPRING]) * damped
        by_rate = -(steep + stop[SPRING] * d) * stop[LOSS]
        for j in range(jacobian.shape[1]):
            push = by_p * (jacobian[Y, j] - jacobian[Z, j]) + by_rate * (jacobian[VY, j] - jacobian[VZ, j])
            jacobian[VY, j] += time_s * push * stop[PER_M1]
            jacobian[VZ, j] -= time_s * push * stop[PER_M2]
    state[VY] += time_s * force * stop[PER_M1]
    state[VZ] -= time_s * force * stop[PER_M2]
    return time_s * force


@kernel_without_refcount
def _carry(flow: Reals, jacobian: Reals, scratch: Reals) -> None:
    """Carry a Jacobian over a flow, in place."""
    for i in range(STATES):
        for j in range(STATES):
            scratch[i, j] = 0.0
        for k in range(STATES):
            factor = flow[i, k]
            for j in range(STATES):
                scratch[i, j] += factor * jacobian[k, j]
    for i in range(STATES):
        for j in range(STATES):
            jacobian[i, j] = scratch[i, j]


@kernel_without_refcount
def flow_step(state: Reals, flow: Reals, base: float, rise: float, scratch: Reals, jacobian: Reals) -> None:
    """Move without stops, exactly, under an acceleration that rises linearly."""
    for i in range(STATES):
        moved = flow[i, STATES] * base + flow[i, STATES + 1] * rise
        for j in range(STATES):
            moved += flow[i, j] * state[j]
        scratch[i, 0] = moved
    for i in range(STATES):
        state[i] = scratch[i, 0]
    if jacobian.shape[0] > 0:
        _carry(flow, jacobian, scratch)


@kernel_without_refcount
def _reaches_stop(before: Reals, after: Reals, stop: Reals, step_s: float) -> bool:
    """Say whether a flight, a cubic between its ends, comes near a stop."""
    p0, p1 = before[Y] - before[Z], after[Y] - after[Z]
    bend = 0.125 * step_s * ((before[VY] - before[VZ]) - (after[VY] - after[VZ]))
    middle = 0.5 * (p0 + p1) + bend
    high, low = max(p0, p1, middle), min(p0, p1, middle)
    return bool(high + _STEP_REACH_M > stop[UPPER] or -low + _STEP_REACH_M > stop[LOWER])


@kernel_without_refcount
def _advance(
    state: Reals,
    before: Reals,
    base: float,
    rise: float,
    flow: Reals,
    small_flow: Reals,
    stop: Reals,
    step_s: float,
    small_steps: int,
    scratch: Reals,
    jacobian: Reals,
    pushed: Reals,
) -> int:
    """Move a state over one sample; gives what the step was, its Jacobian, and the impulse."""
    for i in range(STATES):
        before[i] = state[i]
    flow_step(state, flow, base, rise, scratch, jacobian[:0])
    pushed[0] = 0.0
    if not _reaches_stop(before, state, stop, step_s):
        return FLIGHT
    for i in range(STATES):
        state[i] = before[i]
    if jacobian.shape[0] > 0:
        jacobian[:] = 0.0
        for i in range(STATES):
            jacobian[i, i] = 1.0
    small_s = step_s / small_steps
    for n in range(small_steps):
        pushed[0] += kick(state, stop, 0.5 * small_s, jacobian)
        flow_step(state, small_flow, base + rise * n / small_steps, rise / small_steps, scratch, jacobian)
        pushed[0] += kick(state, stop, 0.5 * small_s, jacobian)
    p = state[Y] - state[Z]
    return IN_CONTACT if p > stop[UPPER] or -p > stop[LOWER] else TOUCHED


@kernel_without_refcount
def _spread(
    covariance: Reals, whole: Reals, noise: Reals, force_variance: float, force_input: Reals, product: Reals
) -> None:
    """Spread by F P F' + Q in place; rows behind the states stay."""
    size = covariance.shape[0]
    for i in range(STATES):
        for j in range(size):
            product[i, j] = 0.0
        for n in range(size):
            factor = whole[i, n]
            for j in range(size):
                product[i, j] += factor * covariance[n, j]
    for i in range(STATES):
        for j in range(STATES, size):
            covariance[i, j] = product[i, j]
            covariance[j, i] = product[i, j]
        for j in range(i, STATES):
            total = noise[i, j] + force_variance * force_input[i] * force_input[j]
            for n in range(size):
                total += product[i, n] * whole[j, n]
            covariance[i, j] = total
            covariance[j, i] = total


@kernel_without_refcount
def _blur(covariance: Reals, impulse: float, stop: Reals) -> None:
    """Add what an error of the impulse between m1 and m2 does."""
    covariance[VY, VY] += (impulse * stop[PER_M1]) ** 2
    covariance[VZ, VZ] += (impulse * stop[PER_M2]) ** 2
    covariance[VY, VZ] -= impulse**2 * stop[PER_M1] * stop[PER_M2]
    covariance[VZ, VY] = covariance[VY, VZ]


@kernel_without_refcount
def _correct(state: Reals, covariance: Reals, innovation: float, variance: float, gain: Reals) -> None:
    """Use one sample."""
    size = state.size
    for i in range(size):
        gain[i] = (covariance[i, VX] + covariance[i, W]) / variance
    for i in range(size):
        state[i] += gain[i] * innovation
        for j in range(i, size):
            covariance[i, j] -= gain[i] * gain[j] * variance
            covariance[j, i] = covariance[i, j]


@kernel
def forward(  # noqa: C901, PLR0912 - a step, its derivatives, and the use of a sample are one loop
    acceleration: Reals,
    velocity: Reals,
    flows: Reals,
    small_flows: Reals,
    stops: Reals,
    deviations: Reals,
    step_s: float,
    small_steps: int,
    noise: Reals,
    velocity_variance: float,
    impulse_share: float,
    force_variance: Reals,
    force_input: Reals,
    limit: float,
    settings: Reals,
    state: Reals,
    covariance: Reals,
    states: Reals,
    covariances: Reals,
    innovations: Reals,
    kinds: Reals,
    jacobians: Reals,
    impulses: Reals,
) -> int:
    """Filter ``velocity.size`` samples, each at the end of a step; gives how many were done before a loss.

    A velocity that is NaN was not measured: the motion goes on without it, as it does in contact.
    ``acceleration`` has one sample more. Row 0 of ``flows`` and ``stops`` is the model; further rows are
    the model with one parameter raised by its deviation. ``settings`` is the running mean of the squared
    normalised innovation, and the share of it that a sample makes up.
    ``states`` and ``covariances`` are those before each sample's update; ``innovations`` holds the
    innovation and its variance, the latter zero where none was used. Jacobians are kept of steps with
    a stop, flights have the model's. Empty arrays of any of them keep nothing.
    """
    size = state.size
    parameters = size - STATES
    scratch = np.empty((STATES, STATES))
    before, moved, other = np.empty(STATES), np.empty(STATES), np.empty(STATES)
    jacobian = np.empty((STATES, STATES))
    whole = np.zeros((size, size))
    product = np.empty((size, size))
    gain = np.empty(size)
    pushed, ignored = np.zeros(1), np.zeros(1)
    for i in range(size):
        whole[i, i] = 1.0
    for k in range(velocity.size):
        base, rise = acceleration[k], acceleration[k + 1] - acceleration[k]
        moved[:] = state[:STATES]
        kind = _advance(
            moved,
            before,
            base,
            rise,
            flows[0],
            small_flows[0],
            stops[0],
            step_s,
            small_steps,
            scratch,
            jacobian,
            pushed,
        )
        for i in range(STATES):
            for j in range(STATES):
                whole[i, j] = flows[0, i, j] if kind == FLIGHT else jacobian[i, j]
        for n in range(parameters):
            other[:] = before
            _advance(
                other,
                scratch[0],
                base,
                rise,
                flows[n + 1],
                small_flows[n + 1],
                stops[n + 1],
                step_s,
                small_steps,
                jacobian,
                jacobian[:0],
                ignored,
            )
            for i in range(STATES):
                whole[i, STATES + n] = (other[i] - moved[i]) / deviations[n]
        for i in range(STATES):
            shift = 0.0
            for n in range(parameters):
                shift += whole[i, STATES + n] * state[STATES + n]
            state[i] = moved[i] + shift
        _spread(covariance, whole, noise, force_variance[k], force_input, product)
        if kind != FLIGHT:
            _blur(covariance, impulse_share * pushed[0], stops[0])
        innovation = velocity[k] - state[VX] - state[W]
        variance = covariance[VX, VX] + 2.0 * covariance[VX, W] + covariance[W, W] + velocity_variance
        is_used = kind != IN_CONTACT and np.isfinite(innovation)
        if states.shape[0] > 0:
            states[k] = state[: states.shape[1]]
            kinds[k] = kind
            impulses[k] = pushed[0]
            innovations[k, 0] = innovation
            innovations[k, 1] = variance if is_used else 0.0
        if covariances.shape[0] > 0:
            covariances[k] = covariance
            if kind != FLIGHT:
                jacobians[k] = whole
        if not is_used:
            continue
        settings[0] += settings[1] * (innovation * innovation / variance - settings[0])
        if not settings[0] < limit:
            return k
        _correct(state, covariance, innovation, variance, gain)
    return int(velocity.size)
