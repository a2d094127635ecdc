"""Where a law acts: what a touch does to the motion, and how it goes on while the force lasts. SI units."""

from ..contact import advance_contact, begin_contact
from ..flight import touched_side
from ..kernels import Table, Vector, kernel_without_refcount
from ..model import VY, VZ, Y, Z
from ..power_law import PowerSystem, advance_smooth
from ..rigid import rebound
from ..slots import Parameters, PowerTerms


@kernel_without_refcount
def contact_onset(state: Vector, par: Parameters, restitution: float | None, tolerance: float) -> None:
    """Touch the stop that m1 has come to; the state is placed on it."""
    side = touched_side(state[Y] - state[Z], state[VY] - state[VZ], par.lower, par.upper)
    if restitution is not None:
        rebound(state, side, par, restitution, tolerance)
    else:
        begin_contact(state, side, par, tolerance)


@kernel_without_refcount
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
) -> tuple[int, float]:
    """Advance while a force acts that yields, to its end or ``limit``; see `vibench.sim.contact`."""
    if power is not None:
        return advance_smooth(state, tau, limit, force, middle, PowerSystem(par, power), tolerance, work)
    return advance_contact(state, tau, limit, force, middle, par, tolerance, work)
