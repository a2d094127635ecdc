"""Periodic motions at one drive, from many initial states: rest, free motion and random states. SI units."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..engine.run import Accuracy, Outcome
from ..motion.integrate import integrate
from ..periodic.branch import OrbitShape
from ..periodic.shooting import PeriodicOrbit, PeriodMap, ShootingEnd, periodic_orbit, smallest_period
from ..specimen.drive import Harmonic
from ..specimen.modes import base_transmissibility
from ..specimen.specimen import Floats, Specimen, state_scales

SETTLED = 1e-3
"""Relative change of the state per period of the motion, below which Newton's iteration is started."""
SAME_MOTION = 1e-5
"""Relative distance of states at the same drive phase, below which two motions count as the same."""
SIMPLER = 1e-6
"""Relative distance of states below which a motion counts as having half the period, or as symmetric."""
NEARLY_MIRRORED = 0.1
WITHIN = 0.9
"""Largest abs(p) of random initial states, relative to the gap on the same side."""
RANDOM_REACH = 3.0
"""Largest x and z of random initial states, relative to the larger of gap and amplitude without stops."""


@dataclass(frozen=True)
class MotionSearch:
    """Settings of the search for periodic motions."""

    places: int = 8
    """Number of evenly spaced parameter values at which to search, including both ends of the range."""
    starts: int = 12
    """Number of random initial states at each value, in addition to rest and motion without contact."""
    settling_periods: int = 300
    most_periods: int = 4
    """Longest period of a motion that the search finds, in drive periods."""
    most_branches: int = 60
    seed: int = 1
    time_s: float = math.inf
    """Limit of the computing time for the search and all branches [s]; an unfinished branch is cut off."""

    def __post_init__(self) -> None:
        if self.places < 2 or self.starts < 0 or self.settling_periods < 2 * self.most_periods:
            raise ValueError(
                f"A search at {self.places} places from {self.starts} starts over {self.settling_periods} "
                "periods is not allowed: give 2 places or more, 0 starts or more, and at least twice the "
                "periods of the longest motion."
            )
        if self.most_periods < 1 or self.most_branches < 1:
            raise ValueError(
                f"{self.most_periods} periods and {self.most_branches} branches: give at least 1 of each."
            )


def periodic_motions(
    specimen: Specimen, drive: Harmonic, search: MotionSearch, until_s: float = math.inf
) -> Iterator[PeriodicOrbit]:
    """Yield periodic motions at one drive, most of them stable.

    Each start is integrated for ``search.settling_periods``. If the motion then nearly repeats, Newton's
    iteration finds the exact periodic motion. A motion and its mirror image are yielded as one motion.

    Parameters
    ----------
    specimen, drive
        Specimen, and drive with phase zero.
    search
        Settings of the search, such as the number of starts.
    until_s
        Time limit as a value of `time.monotonic` [s]; after this time no further start is tried.
    """
    scales = state_scales(specimen, drive)
    met: list[Floats] = []
    for start in _starts(specimen, drive, search):
        if time.monotonic() > until_s:
            return
        orbit = _orbit_from(specimen, drive, start, search)
        if orbit is None:
            continue
        if any(np.abs((orbit.state - each) / scales).max(axis=1).min() < SAME_MOTION for each in met):
            continue
        met.append(orbit_states(orbit))
        yield orbit


def orbit_states(orbit: PeriodicOrbit) -> Floats:
    """Return the states of a motion and of its mirror image once per drive period, shape (n, 6)."""
    mapping = orbit.period_map
    states = [orbit.state]
    one = PeriodMap(mapping.specimen)
    for _ in range(mapping.periods - 1):
        states.append(one.image(states[-1], orbit.drive))
    lower, upper = mapping.specimen.gaps_m
    if lower == upper:
        half = integrate(
            mapping.specimen, orbit.drive, 0.5 / orbit.drive.frequency_hz, Accuracy.REFERENCE, states[0]
        )
        states.append(-half.final_state)
        for _ in range(mapping.periods - 1):
            states.append(one.image(states[-1], orbit.drive))
    return np.array(states)


def _starts(specimen: Specimen, drive: Harmonic, search: MotionSearch) -> Iterator[Floats]:
    """Yield the initial states: rest, the linear motion if it never reaches a stop, then random states."""
    linear = drive.amplitude_m * np.abs(base_transmissibility(specimen, drive.frequency_hz)[0])
    yield np.zeros(6)
    if linear[3] < min(specimen.gaps_m):
        # The state at time zero of the steady motion without stops, driven by U = A0 sin(w t).
        phasors = -1j * drive.amplitude_m * base_transmissibility(specimen, drive.frequency_hz)[0, :3]
        yield np.concatenate([phasors.real, (2j * np.pi * drive.frequency_hz * phasors).real])
    rng = np.random.default_rng([search.seed, int(drive.frequency_hz * 1e3), int(drive.amplitude_m * 1e9)])
    for _ in range(search.starts):
        yield random_state(specimen, drive, rng)


def random_state(specimen: Specimen, drive: Harmonic, rng: np.random.Generator) -> Floats:
    """Return a random state with m1 between the stops, drawn by ``rng``, shape (6,) [m, m/s].

    x and z are within three times the gap or, if larger, three times the amplitude of the motion without
    stops. Velocities are within this range times 2 pi f.
    """
    linear = drive.amplitude_m * np.abs(base_transmissibility(specimen, drive.frequency_hz)[0])
    lower, upper = specimen.gaps_m
    near = min(lower, upper)
    reach = RANDOM_REACH * max(near, float(linear[2]) if np.isfinite(linear[2]) else near)
    speed = 2.0 * np.pi * drive.frequency_hz
    x, z = rng.uniform(-reach, reach, 2)
    p = rng.uniform(-min(lower, 3.0 * near), min(upper, 3.0 * near)) * WITHIN
    rates = rng.uniform(-reach, reach, 3) * speed
    return np.array([x, z + p, z, *rates])


def _orbit_from(
    specimen: Specimen, drive: Harmonic, start: Floats, search: MotionSearch
) -> PeriodicOrbit | None:
    run = integrate(
        specimen,
        drive,
        search.settling_periods / drive.frequency_hz,
        Accuracy.STANDARD,
        start,
        sample_rate_hz=drive.frequency_hz,
    )
    if run.outcome is not Outcome.REACHED_END:
        return None
    section = run.states[-2 * search.most_periods :]
    periods = smallest_period(section, state_scales(specimen, drive), SETTLED, search.most_periods)
    return settled_orbit(specimen, drive, run.final_state, periods or 1)


def settled_orbit(specimen: Specimen, drive: Harmonic, state: Floats, periods: int) -> PeriodicOrbit | None:
    """Return the simplest motion that repeats after ``periods`` drive periods, found by shooting, or None."""
    lower, upper = specimen.gaps_m
    shapes = [OrbitShape.REPEATED]
    if lower == upper and periods % 2 == 1:
        mirrored = PeriodMap(specimen, OrbitShape.MIRRORED, periods).image(state, drive)
        off = float(np.abs((mirrored - state) / state_scales(specimen, drive)).max())
        shapes = [OrbitShape.MIRRORED, *shapes] if off < NEARLY_MIRRORED else [*shapes, OrbitShape.MIRRORED]
    for shape in shapes:
        orbit = periodic_orbit(specimen, drive, shape, periods, state)
        if orbit.outcome is ShootingEnd.CONVERGED:
            return simplest(orbit)
    return None


def simplest(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """Return a motion as a fixed point over its shortest period, or over half of it if symmetric."""
    mapping = orbit.period_map.simpler
    while mapping is not None:
        off = (mapping.image(orbit.state, orbit.drive) - orbit.state) / state_scales(
            mapping.specimen, orbit.drive
        )
        if not float(np.abs(off).max()) < SIMPLER:
            break
        found = periodic_orbit(mapping.specimen, orbit.drive, mapping.shape, mapping.periods, orbit.state)
        if found.outcome is not ShootingEnd.CONVERGED:
            break
        orbit, mapping = found, found.period_map.simpler
    return orbit
