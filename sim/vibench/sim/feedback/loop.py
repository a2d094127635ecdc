"""Whether a motion is stable under a law: multipliers of plant and law together along it."""

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from ..model.arrays import Table
from .law import LinearLaw
from .plant import SampledPlant


def loop_multiplier(
    plant: SampledPlant,
    law: LinearLaw,
    stiffness: ArrayLike,
    damping: ArrayLike = 0.0,
    periods: int = 1,
    parts: int = 1,
) -> float:
    """Give the largest multiplier over a period of a motion, with the law acting: below 1 it is held.

    Parameters
    ----------
    plant
        What is driven; not the one of the design where that was not exact.
    law
        Designed for the same latency, or another.
    stiffness, damping
        Slopes dF/dp [N/m] and dF/d(dp/dt) [N s/m] of the stops' force along the motion, in the middle of each
        part of each sample, shape (samples * parts,).
    periods
        Over how many periods the slopes go; as many as take a whole number of samples, or nearly so.
    parts
        Of a sample: contacts are shorter.

    """
    stretches = _joined(plant, law, parts)
    into, relative = (np.pad(each, (0, len(stretches[0]) - plant.size)) for each in plant.spring)
    rate, part_s = np.roll(relative, 3), plant.timing.step_s / parts
    springs, dampers = np.broadcast_arrays(np.asarray(stiffness) - plant.stiffness, damping)
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
    """Give the base's displacement per volt of what is played beside the law's answer [m/V].

    The phases are those at the moments of the samples; the motion is that without stops.
    """
    before, after = _joined(plant, law, 1)
    played = np.concatenate([plant.stretches()[0][1], np.zeros(len(law.step)), [1.0]])
    turn = np.exp(2j * np.pi * frequency_hz * plant.timing.step_s)
    return complex(np.linalg.solve(turn * np.eye(len(before)) - after @ before, after @ played)[0])


def _joined(plant: SampledPlant, law: LinearLaw, parts: int) -> list[Table]:
    """Stretches of a step of plant, memory of the law, and the volt it gives, which all of them need."""
    own, memory = plant.size, len(law.step)
    answer = np.hstack([law.direct @ plant.shown, law.output])
    (first, of_first), *others = plant.stretches(parts)
    begin = np.zeros((own + memory + 1, own + memory + 1))
    begin[:own, :own], begin[own:-1, :own], begin[own:-1, own:-1] = first, law.inlet @ plant.shown, law.step
    begin[:own, :-1] += np.outer(of_first, answer)
    begin[-1, :-1] = answer[0]
    joined = [begin]
    for stretch, of_volt in others:
        joined.append(np.eye(own + memory + 1))
        joined[-1][:own, :own], joined[-1][:own, -1] = stretch, of_volt
    return joined
