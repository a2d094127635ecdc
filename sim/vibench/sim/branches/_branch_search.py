"""The search for branches, however they are followed: from motions at several places and what leaves them."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from ..model.arrays import Floats
from ..model.drive import Harmonic
from ..model.specimen import Specimen
from ..periodic.branch_following import DrivePath
from ._found_branch import BranchOrigin, FoundBranch, known_among
from ._motion_search import MotionSearch

M = TypeVar("M")
"""A motion, as the method knows it."""


@dataclass(frozen=True, eq=False)
class BranchStart(Generic[M]):
    """A motion that a branch may be begun from."""

    motion: M
    origin: BranchOrigin
    drive: Harmonic
    states: Floats
    """Of it and, where they are known, of its mirror image, once a drive period, shape (n, 6)."""


def branches_from(
    specimen: Specimen,
    path: DrivePath,
    bounds: tuple[float, float],
    search: MotionSearch,
    starts: Callable[[Harmonic], Iterator[BranchStart[M]]],
    follow: Callable[[BranchStart[M]], FoundBranch],
    leaving: Callable[[FoundBranch], Iterable[BranchStart[M]]],
) -> Iterator[FoundBranch]:
    """Follow a branch from every start that lies on none that is known, and from all that leaves it."""
    known: list[FoundBranch] = []
    for value in np.linspace(*bounds, search.places):
        began = time.perf_counter()
        for start in starts(Harmonic(*path.drive(float(value)))):
            fresh = [start]
            while fresh and len(known) < search.most_branches:
                one = fresh.pop()
                if known_among(known, specimen, path, one.drive, one.states):
                    continue
                found = replace(follow(one), elapsed_s=time.perf_counter() - began)
                known.append(found)
                yield found
                fresh += leaving(found)
                began = time.perf_counter()
