"""Rigid stops in time: closed forms of bouncing and sticking, mechanics, an event-driven oracle."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim.accuracy import Accuracy
from sim.drive import Harmonic
from sim.integrate import integrate
from sim.outcome import Outcome
from sim.specimen import gong2025

STILL = Harmonic(100.0, 0.0)
STICKING = Harmonic(200.0, 50e-6)
"""Chatters and sticks 200 times a second on stops of restitution 0.8."""
BOUNCING = Harmonic(130.0, 20e-6)


def rigid(restitution, **options):
    return gong2025(**{"damping_time_s": 3e-5, "contact": f"rigid:{restitution}", **options})


def distance(first, second):
    """Largest difference of two states in units of 100 um and 0.1 m/s."""
    return np.max(np.abs(first - second) / np.repeat([1e-4, 0.1], 3))


def relative(states):
    return states[..., 1] - states[..., 2], states[..., 4] - states[..., 5]


class Oracle:
    """The equations as written, by scipy's DOP853 with events, restarted at every impact and release."""

    CHATTER_ENDS = 1e-8  # m/s

    def __init__(self, specimen, drive):
        self.s, self.drive, self.rho = specimen, drive, specimen.contact.restitution
        self.times = []

    def links(self, state):
        x, y, z, vx, vy, vz = state
        _, k1, k2 = self.s.stiffnesses
        _, c1, c2 = self.s.dampings
        return k2 * (z - x) + c2 * (vz - vx), k1 * (y - z) + c1 * (vy - vz)

    def rates(self, t, state):
        (m0, m1, m2), (k0, _, _), (c0, _, _) = self.s.masses, self.s.stiffnesses, self.s.dampings
        omega, a0 = 2.0 * math.pi * self.drive.frequency_hz, self.drive.amplitude_m
        pull, inner = self.links(state)
        base = k0 * (a0 * math.sin(omega * t) - state[0]) + c0 * (a0 * omega * math.cos(omega * t) - state[3])
        if self.side:
            bound = -pull / (m1 + m2)
            return [*state[3:5], state[5], (pull + base) / m0, bound, bound]
        return [*state[3:], (pull + base) / m0, -inner / m1, (inner - pull) / m2]

    def press(self, state, side):
        (_, m1, m2), (pull, inner) = self.s.masses, self.links(state)
        return side * (pull / m2 - inner * (1.0 / m1 + 1.0 / m2))

    def run(self, duration_s, start):
        t, state, self.side = 0.0, np.array(start, dtype=float), 0.0
        step = 1e-4
        while t < duration_s:
            if self.side:
                events = [lambda t, s: -self.press(s, self.side)]
            else:
                events = [lambda t, s, q=q: q * (s[1] - s[2]) - self.s.gap_m for q in (1.0, -1.0)]
            for event in events:
                event.terminal, event.direction = True, 1.0
            part = solve_ivp(
                self.rates,
                (t, duration_s),
                state,
                "DOP853",
                rtol=1e-12,
                atol=1e-16,
                max_step=step,
                events=events,
            )
            t, state, step = part.t[-1], part.y[:, -1].copy(), 1e-4
            if part.status == 0:
                return state
            if self.side:
                self.side = 0.0
            else:
                step = self.strike(t, state)
        return state

    def strike(self, t, state):
        side = math.copysign(1.0, state[1] - state[2])
        _, m1, m2 = self.s.masses
        before = state[4] - state[5]
        after = -self.rho * before
        self.times.append(t)
        mean = (m1 * state[4] + m2 * state[5]) / (m1 + m2)
        press = self.press(state, side)
        if press > 0.0 and abs(after) < self.CHATTER_ENDS:
            after, self.side = 0.0, side
        state[4], state[5] = mean + m2 / (m1 + m2) * after, mean - m1 / (m1 + m2) * after
        state[1] = state[2] + side * self.s.gap_m
        return abs(after) / (2.0 * abs(press)) if after and press > 0.0 else 1e-4


@pytest.mark.parametrize(
    ("restitution", "drive"),
    [(1.0, BOUNCING), (0.8, BOUNCING), (0.5, STICKING), (0.0, STICKING)],
)
def test_an_independent_event_driven_integrator_agrees(restitution, drive):
    specimen = rigid(restitution)
    oracle = Oracle(specimen, drive)
    theirs = oracle.run(0.02, np.zeros(6))
    ours = integrate(specimen, drive, 0.02, Accuracy.REFERENCE)
    assert ours.outcome is Outcome.REACHED_END
    assert ours.impacts.count > 5
    # Where chatter is cut off is each one's own choice.
    nearest = np.abs(ours.impacts.times_s[:, None] - np.asarray(oracle.times)).min(axis=1)
    assert nearest.max() < 1e-9
    assert distance(ours.final_state, theirs) < 1e-9
