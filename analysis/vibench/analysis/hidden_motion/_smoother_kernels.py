"""The smoother, back over what the filter kept."""

import numpy as np

from vibench.sim.kernels import kernel, kernel_without_refcount

from ..signals import Reals
from ._filter_kernels import FLIGHT, STATES, VX, VY, VZ, W, Y, Z


@kernel_without_refcount
def _carry_back(
    flow: Reals,
    jacobian: Reals,
    kind: float,
    adjoint: Reals,
    carried: Reals,
    matrix: Reals,
    product: Reals,
    turned: Reals,
) -> None:
    """Take the adjoint of a state, and its matrix M, back over the step that led to it: F' M F."""
    step = flow if kind == FLIGHT else jacobian
    for i in range(STATES):
        carried[i] = 0.0
        for j in range(STATES):
            carried[i] += step[j, i] * adjoint[j]
            total = 0.0
            for n in range(STATES):
                total += matrix[i, n] * step[n, j]
            product[i, j] = total
    for i in range(STATES):
        for j in range(STATES):
            total = 0.0
            for n in range(STATES):
                total += step[n, i] * product[n, j]
            turned[i, j] = total
    for i in range(STATES):
        for j in range(STATES):
            matrix[i, j] = 0.5 * (turned[i, j] + turned[j, i])


@kernel_without_refcount
def _use_back(
    innovation: Reals,
    covariance: Reals,
    adjoint: Reals,
    carried: Reals,
    matrix: Reals,
    gain: Reals,
    scratch: Reals,
) -> None:
    """Take the adjoint back over the use of a sample: (I - K H)' M (I - K H) + H' H / S."""
    for i in range(STATES):
        adjoint[i] = carried[i]
    variance = innovation[1]
    if variance == 0.0:
        return
    along, quadratic = 0.0, 0.0
    for i in range(STATES):
        gain[i] = (covariance[i, VX] + covariance[i, W]) / variance
        along += gain[i] * carried[i]
    for i in range(STATES):
        row = 0.0
        for j in range(STATES):
            row += matrix[i, j] * gain[j]
        scratch[0, i] = row
    for i in range(STATES):
        quadratic += gain[i] * scratch[0, i]
    pull = -innovation[0] / variance - along
    adjoint[VX] += pull
    adjoint[W] += pull
    for i in range(STATES):
        side = scratch[0, i]
        matrix[i, VX] -= side
        matrix[i, W] -= side
        matrix[VX, i] -= side
        matrix[W, i] -= side
    added = quadratic + 1.0 / variance
    matrix[VX, VX] += added
    matrix[VX, W] += added
    matrix[W, VX] += added
    matrix[W, W] += added


@kernel_without_refcount
def _variance_of(covariance: Reals, matrix: Reals, first: int, second: int) -> float:
    """Give the smoothed variance of the difference of two states: of P - P M P."""
    told = 0.0
    for i in range(STATES):
        left = covariance[first, i] - covariance[second, i]
        for j in range(STATES):
            told += left * matrix[i, j] * (covariance[j, first] - covariance[j, second])
    own = covariance[first, first] - 2.0 * covariance[first, second] + covariance[second, second]
    return float(max(own - told, 0.0))


@kernel_without_refcount
def _told_force(force_input: Reals, adjoint: Reals, matrix: Reals) -> tuple[float, float]:
    """Give what the adjoint before a sample tells of the force held over the step that ends there."""
    push, told = 0.0, 0.0
    for i in range(STATES):
        push += force_input[i] * adjoint[i]
        for j in range(STATES):
            told += force_input[i] * matrix[i, j] * force_input[j]
    return push, told


@kernel
def backward(
    flow: Reals,
    states: Reals,
    covariances: Reals,
    innovations: Reals,
    kinds: Reals,
    jacobians: Reals,
    force_variance: Reals,
    force_input: Reals,
    smoothed: Reals,
    spreads: Reals,
    forces: Reals,
    matrix: Reals,
) -> None:
    """Smooth what `forward` kept; modified Bryson and Frazier (Bierman, Factorization Methods, 1977, X.3).

    ``spreads`` are the variances of p and of its rate, ``forces`` the latent force and its variance.
    ``matrix`` (8, 8), zero at first, is at the end what the smoothed covariance of the first sample is
    told by: P - P M P, with P from before its update.
    """
    size = STATES
    adjoint, carried = np.zeros(size), np.zeros(size)
    product, turned = np.empty((size, size)), np.empty((size, size))
    gain = np.empty(size)
    for k in range(states.shape[0] - 1, -1, -1):
        if k < states.shape[0] - 1:
            _carry_back(flow, jacobians[k + 1], kinds[k + 1], adjoint, carried, matrix, product, turned)
        _use_back(innovations[k], covariances[k], adjoint, carried, matrix, gain, product)
        for i in range(size):
            change = 0.0
            for j in range(size):
                change += covariances[k, i, j] * adjoint[j]
            smoothed[k, i] = states[k, i] - change
        spreads[k, 0] = _variance_of(covariances[k], matrix, Y, Z)
        spreads[k, 1] = _variance_of(covariances[k], matrix, VY, VZ)
        if forces.shape[0] > 0:
            push, told = _told_force(force_input, adjoint, matrix)
            forces[k, 0] = -force_variance[k] * push
            forces[k, 1] = max(force_variance[k] - force_variance[k] ** 2 * told, 0.0)
