"""A branch that a fast loop followed: its points in the order held, and where it turned."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from vibench.acquisition.recording import (
    BranchEndNote,
    BranchPointNote,
    BranchStabilityNote,
    FeedbackNote,
    Stability,
)

from ..signals.arrays import Reals
from ..tables import Labelled

_LEAST = 3
"""Points that a turn needs."""


@dataclass(frozen=True)
class HeldBranch(Labelled):
    """Motions of one branch; arrays of shape (points,), in the order in which they were held."""

    frequency_hz: Reals
    base_m: Reals
    """Amplitude of the base's fundamental."""
    m0_m: Reals
    """That of m0."""
    phase_deg: Reals
    """Of m0 over the base, as displacements."""
    residue: Reals
    """Harmonics of the base from the second on, rms, over its fundamental: displacement."""
    residue_acceleration: Reals
    stability: tuple[str, ...]
    """Without feedback, under a base that moves as it should: a word of `Stability`; empty where unasked."""
    multiplier: Reals
    """Largest over a period, as small changes told it; NaN where they told nothing."""
    multiplier_u: Reals
    """Its standard uncertainty."""

    @property
    def folds(self) -> tuple[int, ...]:
        """Points at which the frequency turned: motions between two of them lie on the way back."""
        if self.frequency_hz.size < _LEAST:
            return ()
        ways = np.sign(np.diff(self.frequency_hz))
        return tuple(int(each) + 1 for each in np.flatnonzero(ways[1:] != ways[:-1]))


def held_branch(notes: Sequence[FeedbackNote]) -> HeldBranch:
    """Collect what a fast loop noted; empty where it held nothing."""
    points = [each for each in notes if isinstance(each, BranchPointNote)]
    told = {each.point: each for each in notes if isinstance(each, BranchStabilityNote)}
    asked = [told.get(each.point) for each in points]
    sizes = [(nan, nan) if each is None else (each.multiplier, each.multiplier_u) for each in asked]
    multiplier, multiplier_u = np.array(sizes, dtype=np.float64).reshape(-1, 2).T
    return HeldBranch(
        frequency_hz=np.array([each.frequency_hz for each in points]),
        base_m=np.array([each.base_m for each in points]),
        m0_m=np.array([each.m0_m for each in points]),
        phase_deg=np.array([each.phase_deg for each in points]),
        residue=np.array([each.residue for each in points]),
        residue_acceleration=np.array([each.residue_acceleration for each in points]),
        stability=tuple("" if each is None else each.stability.value for each in asked),
        multiplier=multiplier,
        multiplier_u=multiplier_u,
    )


def branch_sentences(notes: Sequence[FeedbackNote]) -> tuple[str, ...]:
    """Say how far a branch was followed, and what it turned at."""
    found, ends = held_branch(notes), [each for each in notes if isinstance(each, BranchEndNote)]
    if not found.frequency_hz.size:
        return ("No motion of the branch was held.",)
    size_um = 1e6 * found.base_m
    held = (
        f"{found.frequency_hz.size} motions held, base {size_um.min():.4g} to {size_um.max():.4g} µm, its "
        f"harmonics at most {found.residue.max():.2g} of that as displacement and "
        f"{found.residue_acceleration.max():.2g} as acceleration."
    )
    told = [held]
    if found.folds:
        turns = ", ".join(f"{found.frequency_hz[each]:.5g}" for each in found.folds)
        told.append(f"The branch turned at {turns} Hz.")
    if any(found.stability):
        counts = ", ".join(f"{found.stability.count(each.value)} {each.value}" for each in Stability)
        told.append(f"Without feedback they would be: {counts}, by small changes of what was played.")
    told.extend(f"It was left because {each.end.value}." for each in ends)
    return tuple(told)
