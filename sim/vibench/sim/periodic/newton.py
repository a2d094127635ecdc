"""Newton's iteration to a periodic motion: a fixed point of the map of a state over a period."""

from collections.abc import Callable, Iterator

import numpy as np

from ..specimen.specimen import Floats

NEUTRAL = 1e-9
"""Distance within which a multiplier counts as on the unit circle; without damping, many multipliers are."""


def newton_iterates(
    image: Callable[[Floats], tuple[Floats, Floats]], state: Floats, scales: Floats, halvings: int = 0
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield the states of Newton's iteration, beginning with the given state, as long as the caller wants.

    Parameters
    ----------
    image
        Map of a state over a period, and its Jacobian; NaN where the map is not defined.
    state, scales
        Initial guess, and scale of each state variable, shape (6,) each.
    halvings
        Number of step lengths to try, each half as long, until the closure error falls; if it does not fall,
        the iteration ends. 0 to take every step.

    Yields
    ------
    State, closure error (image - state) / scales, and Jacobian of the scaled map. The iteration ends where
    the Jacobian is not finite.
    """
    after, jacobian = image(state)
    while True:
        gone, scaled = (after - state) / scales, jacobian * scales / scales[:, None]
        yield state, gone, scaled
        if not bool(np.all(np.isfinite(scaled))):
            return
        step = scales * np.linalg.lstsq(scaled - np.eye(len(state)), gone)[0]
        for halving in range(max(1, halvings)):
            trial = state - 0.5**halving * step
            after, jacobian = image(trial)
            if halvings == 0 or size_of((after - trial) / scales) < size_of(gone):
                break
        else:
            return
        state = trial


def size_of(values: Floats) -> float:
    """Return the largest magnitude of an array; infinite if any value is not finite."""
    size = float(np.max(np.abs(values)))
    return size if np.isfinite(size) else np.inf
