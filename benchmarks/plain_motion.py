"""Motions of the specimen by a code that shares nothing with the engine, to check its results.

The paper's equations are written as in a textbook, without modes, and advanced by compiled steps of DOP853
(Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, section II.10). When m1
touches or leaves a stop, the last step is repeated with a shorter length to find the instant, and the method
restarts there. Extremes are found in the same way, where the velocity passes zero. The integrals of x and p
against the drive are four additional unknowns. The code needs numba, which the extra `peers` installs.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.integrate._ivp import dop853_coefficients as dop853

from vibench.sim import PowerLaw

STAGES = dop853.N_STAGES
A, B, C, E3, E5 = dop853.A, dop853.B, dop853.C, dop853.E3, dop853.E5
FLIGHT, ON_UPPER, ON_LOWER = 0, 1, -1
NOTHING, PEAKS = 0, 1
SIZE = 10
"""Number of unknowns: x, y, z, vx, vy, vz, and integrals of x and p against cosine and sine of the drive."""
UNITS = np.repeat([1e-4, 0.1], 3)
"""Units of errors of a state: 100 um and 0.1 m/s."""
SMALLEST_PART = 1e-2
"""Smallest scale of the error of a component, relative to its unit; smaller for small drive amplitudes."""
MOST_STEPS = 400_000
"""Largest number of steps in a drive period; with more, the run fails."""
FIRST_STEP_S = 1e-7
LONGEST_STEP_S = 1e-5
"""Longest step [s]; in a longer one, a complete bounce could be missed."""
REPEATED = 1e-7
"""Relative difference below which states once per drive period count as repeated."""
MOST_PERIODS = 32


@dataclass(frozen=True)
class PlainMotion:
    """Responses observed in the last part of a run. SI units."""

    responses: np.ndarray
    """Response I and II of m0, and of p, shape (4,)."""
    final_state: np.ndarray
    period: int | None
    """Period in drive periods; None if the motion does not repeat in the window."""


def plain_motion(specimen, drive, duration_s, window_s, start=(0.0,) * 6, tolerance=1e-12):
    """Simulate from time zero and observe the last ``window_s``; return None if the run fails.

    Spectral lines are taken over whole drive periods, or over whole periods of a repeating motion.
    """
    numbers, powers, forces = _numbers(specimen, drive)
    period_s = 1.0 / drive.frequency_hz
    count = math.floor(window_s / period_s * (1.0 + 1e-9))
    begin_s, lines_s = duration_s - window_s, duration_s - count * period_s
    state = np.zeros(SIZE)
    state[:6] = start
    place = np.array([_place(state, numbers)])
    peaks = np.zeros(2)
    sizes = tolerance * UNITS * min(SMALLEST_PART, drive.amplitude_m / 1e-4)
    law = (numbers, powers, forces)
    done = _follow(state, place, 0.0, begin_s, period_s, *law, tolerance, sizes, NOTHING, peaks)
    if lines_s > begin_s:
        done &= _follow(
            state, place, begin_s, lines_s - begin_s, period_s, *law, tolerance, sizes, PEAKS, peaks
        )
    sections, areas = [state[:6].copy()], []
    for k in range(count):
        state[6:] = 0.0
        at_s = lines_s + k * period_s
        done &= _follow(state, place, at_s, period_s, period_s, *law, tolerance, sizes, PEAKS, peaks)
        sections.append(state[:6].copy())
        areas.append(state[6:].copy())
    if not (done and np.all(np.isfinite(state))):
        return None
    period = _period(np.array(sections), drive)
    whole = count if period is None else period * (count // period)
    lines = 2.0 * drive.frequency_hz / whole * np.sum(areas[-whole:], axis=0)
    ii = np.hypot(lines[[0, 2]], lines[[1, 3]])
    found = np.array([peaks[0], ii[0], peaks[1], ii[1]]) / drive.amplitude_m
    return PlainMotion(found, state[:6].copy(), period)


def _period(sections, drive):
    """Return the number of drive periods after which the section repeats; None if it does not."""
    points = sections / np.repeat([1.0, 2.0 * math.pi * drive.frequency_hz], 3)
    size = np.abs(points).max()
    for period in range(1, min(MOST_PERIODS, len(points) - 1) + 1):
        if np.abs(points[period:] - points[:-period]).max() < REPEATED * size:
            return period
    return None


def _numbers(specimen, drive):
    """Return the parameters of specimen, stop and drive, and powers and forces of a power law."""
    law, powers, forces = specimen.contact, np.zeros(0), np.zeros(0)
    lower, upper = specimen.gaps_m
    stiffness, exponent, reference = 0.0, 1.0, 1.0
    if isinstance(law, PowerLaw):
        powers, forces = np.array(law.terms, dtype=np.float64).T.copy()
        lower, upper, reference = math.inf, math.inf, law.reference
    elif law.kind == "linear":
        lower, upper = math.inf, math.inf
    else:
        stiffness, exponent = law.stiffness, {"hertz": 1.5, "linear_gap": 1.0}[law.kind]
    of_drive = (drive.amplitude_m, 2.0 * math.pi * drive.frequency_hz, drive.phase_rad)
    of_law = (lower, upper, stiffness, exponent, reference)
    numbers = np.array([*specimen.masses, *specimen.stiffnesses, *specimen.dampings, *of_law, *of_drive])
    return numbers, powers, forces


@njit(cache=True)
def _place(state, numbers):
    if state[1] - state[2] > numbers[10]:
        return ON_UPPER
    return ON_LOWER if state[2] - state[1] > numbers[9] else FLIGHT


@njit(cache=True)
def _rates(tau, state, place, numbers, powers, forces, out):
    m0, m1, m2, k0, k1, k2, c0, c1, c2 = numbers[:9]
    lower, upper, stiffness, exponent, reference, amplitude, omega, phase = numbers[9:]
    x, y, z, vx, vy, vz = state[:6]
    cosine, sine = math.cos(omega * tau + phase), math.sin(omega * tau + phase)
    p, push = y - z, 0.0
    if place == ON_UPPER and p > upper:
        push = stiffness * (p - upper) ** exponent
    if place == ON_LOWER and -p > lower:
        push = -stiffness * (-p - lower) ** exponent
    for i in range(len(powers)):
        push += forces[i] * (p / reference) ** powers[i]
    inner = k1 * p + c1 * (vy - vz) + push
    outer = k2 * (z - x) + c2 * (vz - vx)
    out[0], out[1], out[2] = vx, vy, vz
    out[3] = (outer + k0 * (amplitude * sine - x) + c0 * (amplitude * omega * cosine - vx)) / m0
    out[4] = -inner / m1
    out[5] = (inner - outer) / m2
    out[6], out[7], out[8], out[9] = x * cosine, x * sine, p * cosine, p * sine


@njit(cache=True)
def _step(state, tau, length, place, numbers, powers, forces, stages, end):
    """Compute one step from the rates in the first stage."""
    trial = np.empty(SIZE)
    for i in range(1, STAGES):
        for n in range(SIZE):
            total = 0.0
            for j in range(i):
                total += A[i, j] * stages[j, n]
            trial[n] = state[n] + length * total
        _rates(tau + C[i] * length, trial, place, numbers, powers, forces, stages[i])
    for n in range(SIZE):
        total = 0.0
        for j in range(STAGES):
            total += B[j] * stages[j, n]
        end[n] = state[n] + length * total
    _rates(tau + length, end, place, numbers, powers, forces, stages[STAGES])


@njit(cache=True)
def _error(stages, state, end, length, tolerance, sizes):
    fifth, third = 0.0, 0.0
    for n in range(6):
        scale = sizes[n] + tolerance * max(abs(state[n]), abs(end[n]))
        e5, e3 = 0.0, 0.0
        for j in range(STAGES + 1):
            e5 += E5[j] * stages[j, n]
            e3 += E3[j] * stages[j, n]
        fifth += (e5 / scale) ** 2
        third += (e3 / scale) ** 2
    if fifth == 0.0:
        return 0.0
    return length * fifth / math.sqrt((fifth + 0.01 * third) * 6.0)


@njit(cache=True)
def _clearance(state, place, which, numbers):
    """Return the distance to the end of a phase at stop 1 (upper) or -1 (lower); positive during it."""
    p = which * (state[1] - state[2])
    left = (numbers[10] if which > 0 else numbers[9]) - p
    return left if place == FLIGHT else -left


@njit(cache=True)
def _closing(state, place, which):
    speed = -which * (state[4] - state[5])
    return speed if place == FLIGHT else -speed


@njit(cache=True)
def _shorten(state, tau, place, numbers, powers, forces, stages, length, other, end):
    """Repeat the step with another length; the first stage is reused."""
    other[0] = stages[0]
    _step(state, tau, length, place, numbers, powers, forces, other, end)


@njit(cache=True)
def _turn(state, tau, place, numbers, powers, forces, stages, length, first, second, other, end):
    """Return the step length after which the velocity of one coordinate relative to another is zero."""
    low, high = 0.0, length
    _shorten(state, tau, place, numbers, powers, forces, stages, length, other, end)
    at_low = state[first] - (state[second] if second >= 0 else 0.0)
    at_high = end[first] - (end[second] if second >= 0 else 0.0)
    at = high
    for k in range(60):
        at = low - at_low * (high - low) / (at_high - at_low)
        if k % 3 == 2 or not low < at < high:
            at = 0.5 * (low + high)
        _shorten(state, tau, place, numbers, powers, forces, stages, at, other, end)
        now = end[first] - (end[second] if second >= 0 else 0.0)
        if now == 0.0 or high - low < 1e-13 * length:
            break
        if (now > 0.0) == (at_low > 0.0):
            if abs(now) < 1e-12 * abs(at_low):
                break
            low, at_low = at, now
        else:
            if abs(now) < 1e-12 * abs(at_high):
                break
            high, at_high = at, now
    return at


@njit(cache=True)
def _end_of_phase(state, tau, place, which, numbers, powers, forces, stages, high, other, end):
    """Return the step length after which the phase ends; it is at most ``high``."""
    low = 0.0
    for _ in range(200):
        at = 0.5 * (low + high)
        _shorten(state, tau, place, numbers, powers, forces, stages, at, other, end)
        left = _clearance(end, place, which, numbers)
        closing = -_closing(end, place, which)
        for _ in range(4):
            # Use Newton's method while it stays within the bracket.
            if closing == 0.0 or not low < at + left / closing < high:
                break
            at += left / closing
            _shorten(state, tau, place, numbers, powers, forces, stages, at, other, end)
            left = _clearance(end, place, which, numbers)
            closing = -_closing(end, place, which)
            if abs(left) < 1e-21:
                return at
        if left > 0.0:
            low = at
        else:
            high = at
        if high - low <= 4e-16 * high:
            break
    return at


@njit(cache=True)
def _peak(best, state, tau, place, numbers, powers, forces, stages, length, end, which, other, spare):
    """Return the largest abs(x) (which = 0) or abs(p) within a step, at least ``best``."""
    if which == 0:
        a, b, va, vb, first, second = state[0], end[0], state[3], end[3], 3, -1
    else:
        a, b = state[1] - state[2], end[1] - end[2]
        va, vb, first, second = state[4] - state[5], end[4] - end[5], 4, 5
    best = max(best, abs(a), abs(b))
    reach = min(abs(a) + length * abs(va), abs(b) + length * abs(vb))
    if va * vb < 0.0 and reach > best:
        _turn(state, tau, place, numbers, powers, forces, stages, length, first, second, other, spare)
        best = max(best, abs(spare[0]) if which == 0 else abs(spare[1] - spare[2]))
    return best


@njit(cache=True)
def _follow(
    state, place, at_s, length_s, period_s, numbers, powers, forces, tolerance, sizes, observe, peaks
):
    """Advance by a length of time, one drive period at a time, so that the drive phase stays exact."""
    begin = at_s / period_s
    turns = begin - math.floor(begin + 1e-9)
    whole = math.floor(length_s / period_s + 1e-9)
    for k in range(whole + 1):
        # A sum of step lengths would drift away from the drive.
        part = period_s if k < whole else length_s - whole * period_s
        tau = turns * period_s
        if part > 1e-12 * period_s and not _advance(
            state, place, tau, tau + part, numbers, powers, forces, tolerance, sizes, observe, peaks
        ):
            return False
    return True


@njit(cache=True)
def _advance(state, place, tau, until, numbers, powers, forces, tolerance, sizes, observe, peaks):
    stages, other = np.empty((STAGES + 1, SIZE)), np.empty((STAGES + 1, SIZE))
    end, spare = np.empty(SIZE), np.empty(SIZE)
    longest = min(LONGEST_STEP_S, 0.05 * (2.0 * math.pi / numbers[15]))
    step = FIRST_STEP_S
    for _ in range(MOST_STEPS):
        if tau >= until:
            return True
        length = min(step, longest, until - tau)
        is_last = length == until - tau
        _rates(tau, state, place[0], numbers, powers, forces, stages[0])
        _step(state, tau, length, place[0], numbers, powers, forces, stages, end)
        error = _error(stages, state, end, length, tolerance, sizes)
        if not error <= 1.0:
            step = length * (max(0.2, 0.9 * error**-0.125) if error < 1e30 else 0.1)
            if step < 1e-18:
                return False
            continue
        grown = length * min(5.0, 0.9 * error**-0.125 if error > 0.0 else 5.0)
        step = max(step, grown) if length < min(step, longest) else grown
        ends, within = 0, length
        if len(powers) == 0:
            ends, within = _first_end(
                state, tau, place[0], numbers, powers, forces, stages, length, end, other, spare
            )
        if ends != 0:
            end[:] = spare
            is_last = False
            # Start with small steps, because the force is a fractional power of time near the contact's end.
            step = FIRST_STEP_S
        for which in range(2 * observe):
            args = (numbers, powers, forces, stages, within, end, which, other, spare)
            peaks[which] = _peak(peaks[which], state, tau, place[0], *args)
        state[:] = end
        tau = until if is_last else tau + within
        if ends != 0:
            place[0] = ends if place[0] == FLIGHT else FLIGHT
    return False


@njit(cache=True)
def _first_end(state, tau, place, numbers, powers, forces, stages, length, end, other, spare):
    """Return the stop at which a phase ends within a step, and the step length; 0 if it does not end."""
    for which in (1, -1):
        if place not in (FLIGHT, which):
            continue
        reach = length
        spare[:] = end
        if _closing(state, place, which) > 0.0 and _closing(end, place, which) < 0.0:
            reach = _turn(state, tau, place, numbers, powers, forces, stages, length, 4, 5, other, spare)
        if _clearance(spare, place, which, numbers) <= 0.0:
            args = (numbers, powers, forces, stages, reach, other, spare)
            return which, _end_of_phase(state, tau, place, which, *args)
    return 0, length
