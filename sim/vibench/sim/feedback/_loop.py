"""Whether a motion is stable under a law: multipliers of plant and law together along it."""

import numpy as np
from numpy.typing import ArrayLike

from ..kernels import Floats, Table
from ._law import LinearLaw
from ._plant import SampledPlant


def loop_multipliers(plant: SampledPlant, law: LinearLaw, slopes: ArrayLike, periods: int = 1) -> Floats:
    """Give the largest multiplier over a period of each motion, with the law acting.

    Parameters
    ----------
    plant
        What is driven; not the one of the design where that was not exact.
    law
        Designed for the same latency, or another.
    slopes
        Slope dF/dp of the stops' force along each motion, once a sample, shape (motions, samples) [N/m].
    periods
        Over how many periods the slopes go; as many as take a whole number of samples, or nearly so.

    Returns
    -------
    Magnitudes, shape (motions,): below 1 a motion is held.

    """
    slopes = np.asarray(slopes, dtype=np.float64)
    before, after = _joined(plant, law)
    into, relative = (np.pad(each, (0, len(before) - plant.size)) for each in plant.spring)
    both, pushed, pulled = after @ before, after @ into, relative @ before
    moved = np.broadcast_to(np.eye(len(both)), (len(slopes), *both.shape)).copy()
    for slope in (slopes - plant.stiffness).T * plant.timing.step_s:
        moved = both @ moved + pushed[:, None] * (slope[:, None] * (pulled @ moved))[:, None, :]
    return np.asarray(np.abs(np.linalg.eigvals(moved)).max(axis=1) ** (1.0 / periods))


def loop_transfer(plant: SampledPlant, law: LinearLaw, frequency_hz: float) -> complex:
    """Give the base's displacement per volt of what is played beside the law's answer [m/V].

    The phases are those at the moments of the samples; the motion is that without stops.
    """
    before, after = _joined(plant, law)
    _, of_first, _, _ = plant.halves
    played = np.concatenate([of_first, np.zeros(len(law.step)), [1.0]])
    turn = np.exp(2j * np.pi * frequency_hz * plant.timing.step_s)
    return complex(np.linalg.solve(turn * np.eye(len(before)) - after @ before, after @ played)[0])


def _joined(plant: SampledPlant, law: LinearLaw) -> tuple[Table, Table]:
    """Both halves of a step of plant, memory of the law, and the volt it gives, which both halves need."""
    first, of_first, second, of_second = plant.halves
    own, memory = plant.size, len(law.step)
    answer = np.hstack([law.direct @ plant.shown, law.output])
    before = np.zeros((own + memory + 1, own + memory + 1))
    before[:own, :own], before[own:-1, :own], before[own:-1, own:-1] = (
        first,
        law.inlet @ plant.shown,
        law.step,
    )
    before[:own, :-1] += np.outer(of_first, answer)
    before[-1, :-1] = answer[0]
    after = np.eye(own + memory + 1)
    after[:own, :own], after[:own, -1] = second, of_second
    return before, after
