"""Reference solution: the equations of motion integrated by scipy; and helpers that several tests use."""

import math
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from vibench.sim import Harmonic, PowerLaw, gong2025, spring_of

UNITS = np.repeat([1e-4, 0.1], 3)
"""Units in which errors of a state are stated: 100 um and 0.1 m/s."""


def paper(contact="hertz", **options):
    return gong2025(**{"damping_time_s": 3e-5, "contact": contact, **options})


def hardening():
    """Return the paper's specimen with a force k3 p^3 instead of stops, 10 % of k1 p at 100 um."""
    specimen = gong2025()
    return replace(specimen, contact=PowerLaw(100e-6, ((3, 0.1 * specimen.stiffnesses[1] * 100e-6),)))


def free_state_matrix(specimen):
    """Return the state matrix without contact, for states (displacements, velocities)."""
    inverse = np.linalg.inv(specimen.mass_matrix)
    rows = [-inverse @ specimen.stiffness_matrix, -inverse @ specimen.damping_matrix]
    return np.block([[np.zeros((3, 3)), np.eye(3)], rows])


def stored_energy(specimen, states):
    """Return kinetic plus elastic energy [J] without that of a contact, with the base at rest."""
    x, y, z, vx, vy, vz = states.T
    (m0, m1, m2), (k0, k1, k2) = specimen.masses, specimen.stiffnesses
    elastic = k0 * x**2 + k1 * (y - z) ** 2 + k2 * (z - x) ** 2
    return 0.5 * (m0 * vx**2 + m1 * vy**2 + m2 * vz**2 + elastic)


def distance(first, second):
    """Return the largest difference of two states in units of 100 um and 0.1 m/s."""
    return np.max(np.abs(first - second) / UNITS)


def as_written(specimen, drive, duration_s, start=(0.0,) * 6, longest_step_s=2e-5):
    """Return the final state by scipy, from the paper's equations and the harmonic-balance force law."""
    (m0, m1, m2), (k0, k1, k2), (c0, c1, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    spring, size = spring_of(specimen), drive.amplitude_m

    def drive_angle(t):
        """Return the drive angle [rad] and its rate [rad/s]."""
        if isinstance(drive, Harmonic):
            omega = 2.0 * math.pi * drive.frequency_hz
            return omega * t, omega
        return 2.0 * math.pi * drive.turns(np.asarray(t)), 2.0 * math.pi * drive.frequency_hz(np.asarray(t))

    def rates(t, state):
        x, y, z, vx, vy, vz = state
        angle, omega = drive_angle(t)
        force = spring.force(np.array([y - z]), np.array([vy - vz]))[0]
        upper, inner = k2 * (z - x) + c2 * (vz - vx), k1 * (y - z) + c1 * (vy - vz) + force
        base = k0 * (size * math.sin(angle) - x) + c0 * (size * omega * math.cos(angle) - vx)
        return [vx, vy, vz, (upper + base) / m0, -inner / m1, (inner - upper) / m2]

    limits = {"rtol": 1e-11, "atol": 1e-15, "max_step": longest_step_s}
    return solve_ivp(rates, (0.0, duration_s), start, "DOP853", **limits).y[:, -1]
