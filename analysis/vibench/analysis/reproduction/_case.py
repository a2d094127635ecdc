"""A case: one reading of everything that the paper leaves open, under a name.

The dampings at which claims are measured again: the paper leaves its unit open.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..model import LogarithmOf
from ..paper_figures import FigureOptions

SWEEP_AMPLITUDE_M = 5e-6
"""Base amplitude of the sweep of Fig. 13(d): the one that the paper sets beside 1.5 V."""
EQUAL_PARTS = "power:3+5+7"
AS_CHOSEN = "the defaults"
PUSH, PUSHED_HZ = 1e-6, 260.0
"""Of other starts: displacements over the gap, and velocities over those at this frequency."""
State = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Case:
    """Options under which claims are measured."""

    name: str
    options: FigureOptions
    sweep_amplitude_m: float = SWEEP_AMPLITUDE_M
    sum_model: str = EQUAL_PARTS
    """The model n = 3+5+7, and how its terms share the force."""
    draw: int = 0
    """Start: 0 is rest; every other number is another start, a millionth of the gap away from it."""

    @property
    def start(self) -> State:
        """X, y, z, vx, vy, vz [m, m/s] at the beginning."""
        if self.draw == 0:
            return (0.0,) * 6
        speed = 2.0 * math.pi * PUSHED_HZ
        x, y, z, vx, vy, vz = PUSH * self.options.gap_m * np.random.default_rng(self.draw).uniform(-1, 1, 6)
        return (float(x), float(y), float(z), float(speed * vx), float(speed * vy), float(speed * vz))


@dataclass(frozen=True)
class Alternative:
    """One option changed."""

    name: str
    apply: Callable[[Case], Case]

    def of(self, case: Case) -> Case:
        """Give the case with the option changed, under the option's name."""
        return replace(self.apply(case), name=self.name)


def damping(damping_time_s: float) -> Alternative:
    """Change c_i / k_i."""
    return Alternative(
        f"c = {damping_time_s:.3g} s · k",
        lambda case: replace(case, options=replace(case.options, damping_time_s=damping_time_s)),
    )


def gapped(gap_m: float) -> Alternative:
    """Change the clearance; the paper's has a tolerance of 15 um."""
    return Alternative(
        f"gap {1e6 * gap_m:g} µm", lambda case: replace(case, options=replace(case.options, gap_m=gap_m))
    )


def logarithm(of: LogarithmOf) -> Alternative:
    """Change what the logarithm of eq. 6 is taken of."""
    return Alternative(
        f"log10 of the response [{of.value}]",
        lambda case: replace(case, options=replace(case.options, logarithm_of=of)),
    )


def compared_up_to(highest_hz: float) -> Alternative:
    """Change the upper end of the frequencies at which models are compared."""
    return Alternative(
        f"models compared up to {highest_hz:g} Hz",
        lambda case: replace(case, options=replace(case.options, similarity_highest_hz=highest_hz)),
    )


def swept_at(amplitude_m: float) -> Alternative:
    """Change the base amplitude of the sweep."""
    return Alternative(
        f"sweep of {1e6 * amplitude_m:g} µm", lambda case: replace(case, sweep_amplitude_m=amplitude_m)
    )


def summed(model: str) -> Alternative:
    """Change how the three terms of the sum share the force."""
    return Alternative(f"the sum as {model}", lambda case: replace(case, sum_model=model))


SCORED_S = (1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5, 4e-5, 5e-5)
"""c_i / k_i: 1e-5 s is the literal reading in mm, g and ms; the chaos that the paper shows ends above."""
DAMPINGS = tuple(damping(value) for value in SCORED_S if value != FigureOptions.damping_time_s)
"""Tried, in this order, where a claim turns on the damping."""
