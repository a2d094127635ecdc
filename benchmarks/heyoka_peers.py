"""Solve the motions of work_precision.py with heyoka, in plain variables and in variables tuned for it.

The plain formulation has the equations of motion, and an event for each stop and direction. The tuned one
suits a Taylor series. In contact, the penetration is w^2 and time runs as w, so that Hertz's force is k w^3
and the equations are polynomials. One event serves touching and leaving, all variables are of order one, and
eight trajectories share the SIMD lanes of a processor. High accuracy is off in both, as by default.
"""

import math
import time

import heyoka as hy
import numpy as np

HAIR_M = 1e-11
"""Additional depth at which contact begins: the series of depth^1.5 does not converge at zero."""
LANES = 8
APART = 1e-6
"""Distance between the initial states of the SIMD lanes, relative to the gap."""
SPEED = 2000.0
"""Unit of speeds divided by the gap [1/s]; half or twice this value makes no difference."""
ROOT_M = 1e-3
"""Unit of w [m^0.5]: the value of w at the largest depth of an impact at 0.1 m/s."""


def plain(constants, tolerance, start, span_s):
    """Return a function that runs the plain equations; par[0] is the side of the active stop."""
    (m0, m1, m2), (k0, k1, k2), (c0, c1, c2) = constants[0:3], constants[3:6], constants[6:9]
    amplitude, omega, gap, stiffness, exponent, power, force, reference = constants[9:17]
    x, y, z, vx, vy, vz = hy.make_vars("x", "y", "z", "vx", "vy", "vz")
    p, side = y - z, hy.par[0]
    if force > 0.0:
        push = force * (p / reference) ** power
    elif exponent == 1.0:
        push = stiffness * side * (side * p - gap)
    else:
        # Away from the stop, replace the depth by one, because zero to the power 0.5 has no series.
        depth = side * side * (side * p - gap) + (1.0 - side * side)
        push = stiffness * side * depth**exponent
    inner = k1 * p + c1 * (vy - vz) + push
    outer = k2 * (z - x) + c2 * (vz - vx)
    base, base_rate = amplitude * hy.sin(omega * hy.time), amplitude * omega * hy.cos(omega * hy.time)
    system = [
        (x, vx),
        (y, vy),
        (z, vz),
        (vx, (outer + k0 * (base - x) + c0 * (base_rate - vx)) / m0),
        (vy, -inner / m1),
        (vz, (inner - outer) / m2),
    ]
    events = [] if force > 0.0 else _plain_events(p, gap + (HAIR_M if exponent != 1.0 else 0.0))
    solver = hy.taylor_adaptive(
        system, list(start), tol=tolerance, t_events=events, **{} if force > 0.0 else {"pars": [0.0]}
    )
    if events and abs(start[1] - start[2]) > gap:
        solver.pars[0] = math.copysign(1.0, start[1] - start[2])

    def job():
        outcome = solver.propagate_until(span_s)[0]
        return solver.state.copy() if outcome == hy.taylor_outcome.time_limit else None

    return job


def _plain_events(p, gap):
    """Return one event for each stop and direction, which switches the stop force on or off."""

    def switch(side):
        def callback(solver, _):
            solver.pars[0] = side
            return True

        return callback

    direction = hy.event_direction
    return [
        hy.t_event(p - gap, callback=switch(1.0), direction=direction.positive),
        hy.t_event(p - gap, callback=switch(0.0), direction=direction.negative),
        hy.t_event(p + gap, callback=switch(-1.0), direction=direction.negative),
        hy.t_event(p + gap, callback=switch(0.0), direction=direction.positive),
    ]


class AtHome:
    """The equations in variables that suit a Taylor series.

    Under Hertz's law, the first variable is p in flight and w in contact; under the others it is p. Then
    follow dp/dt, x, z, vx, vz, and under Hertz's law time. Displacements are in gaps (power laws: in p_ref).
    Parameters are the side, whether its stop pushes, and under Hertz's law whether it does not.
    """

    def __init__(self, constants):
        (m0, m1, m2), (k0, k1, k2), (c0, c1, c2) = constants[0:3], constants[3:6], constants[6:9]
        amplitude, omega, gap, stiffness, exponent, power, force, reference = constants[9:17]
        self.is_power, self.is_hertz = force > 0.0, exponent != 1.0 and force <= 0.0
        self.flying = (0.0, 0.0)
        self.length = length = reference if self.is_power else gap
        self.speed = speed = length * SPEED
        q, rate, x, z, vx, vz, later = hy.make_vars("q", "rate", "x", "z", "vx", "vz", "later")
        t = later if self.is_hertz else hy.time
        side, pushed, free = hy.par[0], hy.par[1], hy.par[2]
        pace, p, turn, self.event = 1.0, q, (speed / length) * rate, q * q - 1.0
        if self.is_power:
            push = force * q**power
        elif self.is_hertz:
            pace = free + pushed * q
            self.flying = (*self.flying, 1.0)
            p = free * q + side * (1.0 + (ROOT_M**2 / length) * (q * q))
            push = (stiffness * ROOT_M**3) * (side * q) * (q * q)
            turn = free * turn + side * (0.5 * speed / ROOT_M**2) * rate
            self.event = free * self.event + pushed * q
        else:
            push = stiffness * length * (pushed * q - side)
        inner = k1 * length * p + c1 * speed * rate + push
        outer = k2 * length * (z - x) + c2 * speed * (vz - vx)
        base = k0 * amplitude * hy.sin(omega * t) + c0 * amplitude * omega * hy.cos(omega * t)
        self.time = t
        self.system = [
            (q, turn),
            (rate, pace * (outer / (m2 * speed) - inner * ((1.0 / m1 + 1.0 / m2) / speed))),
            (x, (speed / length) * (pace * vx)),
            (z, (speed / length) * (pace * vz)),
            (vx, pace * ((outer + base - k0 * length * x - c0 * speed * vx) / (m0 * speed))),
            (vz, pace * ((inner - outer) / (m2 * speed))),
        ]
        if self.is_hertz:
            self.system.append((t, pace))

    def variables(self, start):
        """Return the variables for a state x, y, z, vx, vy, vz in flight."""
        x, y, z, vx, vy, vz = start
        assert self.is_power or abs(y - z) < self.length
        lengths, speeds = np.array([y - z, x, z]) / self.length, np.array([vy - vz, vx, vz]) / self.speed
        return np.array([lengths[0], speeds[0], *lengths[1:], *speeds[1:], 0.0])[: len(self.system)]

    def state(self, at, pars):
        """Return the state x, y, z, vx, vy, vz for the variables."""
        p = at[0] * self.length
        if self.is_hertz and pars[1] > 0.0:
            p = pars[0] * (self.length + (ROOT_M * at[0]) ** 2)
        (x, z), (rate, vx, vz) = self.length * at[2:4], self.speed * at[[1, 4, 5]]
        return np.array([x, z + p, z, vx, vz + rate, vz])

    def switched(self, q, pars):
        """Return first variable and parameters after touching or leaving the stop."""
        if pars[1] > 0.0:
            return (pars[0] if self.is_hertz else q), self.flying
        return (0.0 if self.is_hertz else q), self.pushed_to(math.copysign(1.0, q))

    def pushed_to(self, side):
        """Return the parameters of a contact."""
        return (side, 1.0, 0.0)[: len(self.flying)]

    def end(self, tolerance, start, span_s):
        """Return the state after ``span_s``; None if heyoka fails."""
        events, pars = [hy.t_event(self.time - span_s)] if self.is_hertz else [], {}
        if not self.is_power:

            def switch(solver, _):
                solver.state[0], solver.pars[:] = self.switched(solver.state[0], solver.pars)
                return True

            events.append(hy.t_event(self.event, callback=switch))
            pars = {"pars": list(self.flying)}
        solver = hy.taylor_adaptive(
            self.system, list(self.variables(start)), tol=tolerance, t_events=events, **pars
        )
        solver.propagate_until(100.0 * span_s if self.is_hertz else span_s)
        reached = solver.state[6] if self.is_hertz else solver.time
        return self.state(solver.state, solver.pars) if reached >= span_s * (1.0 - 1e-9) else None

    def cost(self, lanes, tolerance, start, length_s):
        """Return processor time over simulated time, with ``lanes`` trajectories at once."""
        at = np.repeat(self.variables(start)[:, None], lanes, axis=1)
        at[0] += APART * np.arange(lanes)
        held, more = [False] * lanes, {}
        if not self.is_power:
            # A list of flags per lane takes a quarter of the time of an array.
            flying, pushed = (
                np.array(self.flying),
                {side: np.array(self.pushed_to(side)) for side in (1.0, -1.0)},
            )

            def switch(_solver, _direction, lane):
                if held[lane]:
                    if self.is_hertz:
                        state[0, lane] = pars[0, lane]
                    pars[:, lane] = flying
                else:
                    pars[:, lane] = pushed[math.copysign(1.0, state[0, lane])]
                    if self.is_hertz:
                        state[0, lane] = 0.0
                held[lane] = not held[lane]
                return True

            more["t_events"] = [hy.t_event_batch(self.event, callback=switch)]
            more["pars"] = np.repeat(np.array(self.flying)[:, None], lanes, axis=1)
        solver = hy.taylor_adaptive_batch(self.system, at, tol=tolerance, **more)
        state, pars = solver.state, solver.pars
        begun = time.thread_time()
        solver.propagate_for(length_s)
        taken = time.thread_time() - begun
        simulated = (state[6] if self.is_hertz else solver.time).sum()
        return taken / simulated if np.isfinite(simulated) and simulated > 0.0 else None
