"""Where a law acts: what a touch does to the motion, and how it goes on while the force lasts. SI units."""

from ..compiled import lean
from .contact import advance_contact, begin_contact
from .detection import touched_side
from .parameters import VY, VZ, Parameters, PowerTerms, Table, Vector, Y, Z
from .power_flow import PowerSystem
from .rigid_stop import rebound
from .smooth import advance_smooth


@lean
def strike(state: Vector, par: Parameters, restitution: float | None, tolerance: float) -> None:
    """Touch the stop that m1 has come to; the state is placed on it."""
    side = touched_side(state[Y] - state[Z], state[VY] - state[VZ], par.lower, par.upper)
    if restitution is not None:
        rebound(state, side, par, restitution, tolerance)
    else:
        begin_contact(state, side, par, tolerance)


@lean
def advance_touching(
    state: Vector,
    tau: float,
    limit: float,
    force: Vector,
    middle: float,
    par: Parameters,
    power: PowerTerms | None,
    tolerance: float,
    work: Table,
    log: Table,
) -> tuple[int, float]:
    """Advance while a force acts that yields, to its end or ``limit``; see `vibench.sim.engine.contact`."""
    if power is not None:
        return advance_smooth(state, tau, limit, force, middle, PowerSystem(par, power), tolerance, work)
    return advance_contact(state, tau, limit, force, middle, par, tolerance, work, log)
