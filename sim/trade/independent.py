"""A second opinion: the equations as the paper writes them, by a general solver that knows nothing of ours.

Shares no code with the engine. Slow: minutes of processor time for seconds of motion.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from ..drive import Harmonic
from ..restoring_force import spring_of
from ..specimen import Specimen
from ..trajectory import Floats

Rates = Callable[[float, Floats], Floats]
TIGHT = 1e-12
SMALLEST_M = 1e-16
UNWATCHED_S = 1e-8
"""Far shorter than a contact, far longer than an event is found to."""
LONGEST_STEP_S = 1e-4
"""A step of the general solver may not leap over a whole contact without seeing it."""


def plain_rates(specimen: Specimen, drive: Harmonic) -> Rates:
    """Give d/dt of x, y, z, vx, vy, vz as Gong et al. 2025, eq. 1, says."""
    spring = spring_of(specimen)
    m0, m1, m2 = specimen.masses
    k0, k1, k2 = specimen.stiffnesses
    c0, c1, c2 = specimen.dampings
    omega, phase = 2.0 * np.pi * drive.frequency_hz, drive.phase_rad

    def rates(time_s: float, state: Floats) -> Floats:
        x, y, z, vx, vy, vz = state
        base = drive.amplitude_m * np.sin(omega * time_s + phase)
        base_rate = drive.amplitude_m * omega * np.cos(omega * time_s + phase)
        p, rate = np.array([y - z]), np.array([vy - vz])
        inner = k1 * p[0] + c1 * rate[0] + float(spring.force(p, rate)[0])
        outer = k2 * (z - x) + c2 * (vz - vx)
        return np.array(
            [
                vx,
                vy,
                vz,
                (outer + k0 * (base - x) + c0 * (base_rate - vx)) / m0,
                -inner / m1,
                (inner - outer) / m2,
            ]
        )

    return rates


def independent_state(
    specimen: Specimen, drive: Harmonic, duration_s: float, state: Floats, tolerance: float = TIGHT
) -> Floats:
    """Follow a motion with scipy's DOP853, begun anew wherever a stop is touched or left.

    Parameters
    ----------
    specimen, drive
        Any law with a finite force.
    duration_s, state
        From time zero at x, y, z, vx, vy, vz, shape (6,).
    tolerance
        Relative error of a step; tighten it to see the error of the result.

    Returns
    -------
    The state at the end, shape (6,). At 1e-12 it is good to some 1e-10 of (100 um, 0.1 m/s) after a second of
    periodic impacts.

    Raises
    ------
    ArithmeticError
        When the general solver gives up.

    """
    events = [_crossing(gap, side) for gap, side in zip(specimen.gaps_m, (-1.0, 1.0), strict=True)]
    for event in events:
        event.terminal = True  # type: ignore[attr-defined]
    rates, now, time_s = plain_rates(specimen, drive), np.asarray(state, dtype=np.float64), 0.0
    watched: list[Callable[[float, Floats], float]] | None = None
    while time_s < duration_s:
        # A stop just touched or left would be found again at once: first step off it, unwatched.
        until = duration_s if watched is not None else min(duration_s, time_s + UNWATCHED_S)
        run = solve_ivp(
            rates,
            (time_s, until),
            now,
            method="DOP853",
            rtol=tolerance,
            atol=SMALLEST_M,
            events=watched,
            max_step=LONGEST_STEP_S,
        )
        if run.status < 0:
            raise ArithmeticError(f"the independent solution stopped at {run.t[-1]} s: {run.message}")
        now, time_s = run.y[:, -1], float(run.t[-1])
        watched = events if watched is None else None
    return np.asarray(now)


def _crossing(gap_m: float, side: float) -> Callable[[float, Floats], float]:
    def event(_time_s: float, state: Floats) -> float:
        return side * float(state[1] - state[2]) - gap_m

    return event
