"""What of the paper hangs on settings that it leaves open, and what cannot hold together.

python benchmarks/paper_settings.py

Closed forms where there are any; else exponents of our own motion, and the same equations of motion (Gong
et al. 2025, eqs. 1 to 3) by the classical method of Runge and Kutta with steps of fixed length.
"""

import math

import numba
import numpy as np

from vibench.sim import Harmonic, base_transmissibility, gong2025, lyapunov_exponent

GAP_M, LEVEL_M, STIFFNESS = 45e-6, 5e-6, 4.891e9
DAMPINGS_S = (1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5, 4e-5, 5e-5)


def linear_table() -> None:
    """Say when m1 first reaches its stops at 1 um, and between which frequencies it does at 5 um."""
    print(
        "| c / k [s] | \\|x / U\\| at its peak near 95 Hz | level at which p reaches the gap there [um] "
        "| p reaches the gap at 5 um between [Hz] |\n|---|---|---|---|"
    )
    near, second = np.arange(80.0, 110.0, 0.01), np.arange(230.0, 310.0, 0.01)
    for damping_s in DAMPINGS_S:
        specimen = gong2025(damping_time_s=damping_s)
        x, _, _, p = np.abs(base_transmissibility(specimen, near)).T
        over = second[np.abs(base_transmissibility(specimen, second)[:, 3]) * LEVEL_M > GAP_M]
        ends = f"{over[0]:.1f} to {over[-1]:.1f}" if over.size else "nowhere"
        print(f"| {damping_s:g} | {x.max():.3g} | {GAP_M / p.max() * 1e6:.3g} | {ends} |")


def exponent_table() -> None:
    """Say how chaotic the motion is where it collides at 5 um, around the first and the second resonance."""
    print(
        "| frequency [Hz] | "
        + " | ".join(f"c / k = {each:g} s" for each in (1e-5, 2e-5))
        + " |\n|---|---|---|"
    )
    for frequency_hz in (90.0, 95.0, 100.0, 105.0, 250.0, 260.0, 270.0, 280.0):
        found = [
            lyapunov_exponent(gong2025(damping_time_s=each), Harmonic(frequency_hz, LEVEL_M))
            for each in (1e-5, 2e-5)
        ]
        cells = (known(each.exponent_per_s, 2 * each.standard_error_per_s) for each in found)
        print(f"| {frequency_hz:g} | " + " | ".join(cells) + " |")


def known(value: float, bound: float) -> str:
    """Write a value to the digit that is known; regular motion is known to many."""
    return f"{value:.1f}" if bound < 0.05 else f"{value:.0f} ± {bound:.0f}"


@numba.njit(cache=False)
def rates(time_s, state, masses, stiff, damp, omega, amplitude_m):  # type: ignore[no-untyped-def]
    """Give the derivative of x, y, z, vx, vy, vz."""
    x, y, z, vx, vy, vz = state
    base, base_v = amplitude_m * math.sin(omega * time_s), amplitude_m * omega * math.cos(omega * time_s)
    p = y - z
    over = abs(p) - GAP_M
    push = math.copysign(STIFFNESS * over**1.5, p) if over > 0.0 else 0.0
    bottom = stiff[0] * (x - base) + damp[0] * (vx - base_v)
    top = stiff[2] * (z - x) + damp[2] * (vz - vx)
    inner = stiff[1] * p + damp[1] * (vy - vz) + push
    return np.array([vx, vy, vz, (top - bottom) / masses[0], -inner / masses[1], (inner - top) / masses[2]])


@numba.njit(cache=False)
def step(time_s, state, h, masses, stiff, damp, omega, amplitude_m):  # type: ignore[no-untyped-def]
    """Take one step of the classical method of Runge and Kutta."""
    a = rates(time_s, state, masses, stiff, damp, omega, amplitude_m)
    b = rates(time_s + h / 2, state + h / 2 * a, masses, stiff, damp, omega, amplitude_m)
    c = rates(time_s + h / 2, state + h / 2 * b, masses, stiff, damp, omega, amplitude_m)
    d = rates(time_s + h, state + h * c, masses, stiff, damp, omega, amplitude_m)
    return state + h / 6 * (a + 2 * b + 2 * c + d)


@numba.njit(cache=False)
def two_trajectories(h, duration_s, masses, stiff, damp, omega, amplitude_m):  # type: ignore[no-untyped-def]
    """Mean rate at which neighbours part from the fifth second on [1/s]; NaN when the motion is lost."""
    scale = np.array([1.0, 1.0, 1.0, omega, omega, omega])
    one, apart = np.zeros(6), 1e-9
    other = one + apart / math.sqrt(6.0) * scale
    total, counted_s = 0.0, 0.0
    for k in range(int(duration_s / h)):
        one = step(k * h, one, h, masses, stiff, damp, omega, amplitude_m)
        other = step(k * h, other, h, masses, stiff, damp, omega, amplitude_m)
        if k % 50 == 49:
            size = math.sqrt((((other - one) / scale) ** 2).sum())
            if not size < 1e-3:
                return math.nan
            other = one + (other - one) * (apart / size)
            if k * h > 5.0:
                total += math.log(size / apart)
                counted_s += 50 * h
    return total / counted_s


def numerics_table(duration_s: float = 45.0) -> None:
    """Compare exponent and energy of one impact by fixed steps with the exact motion."""
    specimen, drive = gong2025(), Harmonic(260.0, LEVEL_M)
    parts = [np.array(each) for each in (specimen.masses, specimen.stiffnesses, specimen.dampings)]
    exact = lyapunov_exponent(specimen, drive)
    print(
        "| method | energy kept by an impact at 0.03, 0.1, 0.3 m/s | exponent at 260 Hz and 5 um [1/s] |\n"
        f"|---|---|---|\n| exact flight, resolved contact | 1 | {exact.exponent_per_s:.0f} ± "
        f"{2 * exact.standard_error_per_s:.0f} |"
    )
    for h in (2e-5, 1e-5, 5e-6):
        found = two_trajectories(h, duration_s, *parts, 2 * math.pi * 260.0, LEVEL_M)
        kept = ", ".join(f"{energy_kept(h, each):.3g}" for each in (0.03, 0.1, 0.3))
        print(f"| Runge-Kutta, steps of {h:g} s | {kept} | {found:.0f} |")
    lasts = (2.9432 / each * (1.25 * MASS * each**2 / STIFFNESS) ** 0.4 for each in (0.03, 0.1, 0.3))
    print("\nA contact at these speeds lasts (Hertz): " + ", ".join(f"{1e6 * each:.0f} us" for each in lasts))


MASS = 2.1e-3 * 2e-3 / (2.1e-3 + 2e-3)
"""Reduced mass of m1 and m2 in an impact that nothing else holds [kg]."""


def contact(_: float, state: np.ndarray) -> list[float]:
    """Indentation and its speed of a free impact."""
    return [state[1], -STIFFNESS / MASS * max(state[0], 0.0) ** 1.5]


def energy_kept(h: float, speed: float, starts: int = 50) -> float:
    """Mean over when in a step the contact begins."""
    kept = []
    for share in np.linspace(0.0, 1.0, starts, endpoint=False):
        state = np.array([-share * h * speed, speed])
        for _ in range(10_000):
            a = np.array(contact(0.0, state))
            b = np.array(contact(0.0, state + h / 2 * a))
            c = np.array(contact(0.0, state + h / 2 * b))
            d = np.array(contact(0.0, state + h * c))
            state = state + h / 6 * (a + 2 * b + 2 * c + d)
            if state[0] < 0.0 and state[1] < 0.0:
                break
        kept.append((state[1] / speed) ** 2)
    return float(np.mean(kept))


if __name__ == "__main__":
    for table in (linear_table, exponent_table, numerics_table):
        print()
        table()
