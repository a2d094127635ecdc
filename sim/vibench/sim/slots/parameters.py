"""What the kernels need to know of a specimen: plain numbers, ready to multiply. SI units.

Also the layout of the one state vector that every kernel advances in place.
"""

import math
from itertools import pairwise
from typing import NamedTuple

from ..model.no_contact import NoContact
from ..model.power_law import MOST_TERMS, PowerLaw
from ..model.specimen import Specimen

SIDE = 6
"""0 in flight; +1 or -1 while m1 presses on the stop at positive or negative p."""
ROOT, RATE = 7, 8
"""In contact: w, the square root of the penetration [m^0.5], and its rate r = d|p|/dt [m/s]. Under a power
law p and dp/dt themselves."""
STEP = 9
"""In contact: the next step that the step control proposes, in s with dt = w ds [s/m^0.5]; under a power law
in time [s]."""
ROOT_SCALE, RATE_SCALE = 10, 11
"""In contact: how large w and r will become, the measure of their errors."""
PACE = 12
"""In contact: w over r, as large as they will become: the time scale of the collision, in s [s/m^0.5]."""
STATE_SIZE = 13


class Parameters(NamedTuple):
    """The specimen as numbers.

    A stop that yields by w^2 pushes with (linear_stiffness w^2 + contact_stiffness w^3) (1 + loss r).
    """

    mass0: float
    mass1: float
    mass2: float
    k0: float
    k1: float
    k2: float
    c0: float
    c1: float
    c2: float
    lower: float
    """Clearance of the stop at negative p; infinite where there is none."""
    upper: float
    """The same at positive p."""
    reduced_mass: float
    """m1 m2 / (m1 + m2): the mass that a collision of the two feels."""
    inverse0: float
    """1 / m0; a division keeps a contact waiting longer than all its other sums."""
    inverse2: float
    """1 / m2."""
    inverse_pair: float
    """1 / reduced mass."""
    linear_stiffness: float
    contact_stiffness: float
    loss: float
    restitution: float | None
    """Of stops that do not yield; None tells a kernel, by its type, that they do."""


def parameters(specimen: Specimen) -> Parameters:
    """Turn a specimen into the numbers of the kernels."""
    stops = specimen.contact.stops
    lower, upper = specimen.gaps_m
    if isinstance(specimen.contact, NoContact):
        lower, upper = math.inf, math.inf
    # A whole number is another type to a kernel, which would be compiled anew for it.
    m0, m1, m2 = (float(mass) for mass in specimen.masses)
    k0, k1, k2 = (float(stiffness) for stiffness in specimen.stiffnesses)
    c0, c1, c2 = (float(damping) for damping in specimen.dampings)
    pair = m1 * m2 / (m1 + m2)
    in0, in2, in_pair = 1.0 / m0, 1.0 / m2, 1.0 / pair
    return Parameters(
        m0, m1, m2, k0, k1, k2, c0, c1, c2, float(lower), float(upper), pair, in0, in2, in_pair, *stops
    )


class PowerTerms(NamedTuple):
    """A power law for Horner's scheme in q = (p/p_ref)^2: p/p_ref q^h1 (F1 + q^h2 (F2 + ...)).

    Plain numbers, because an array costs a kernel more than the law itself.
    """

    inverse_reference: float
    halves: tuple[int, ...]
    """Half of how much an exponent is above the one before; zero where there is no term."""
    forces: tuple[float, ...]
    """Of each term at p_ref [N]."""


def power_terms(specimen: Specimen) -> PowerTerms | None:
    """Turn a power law into numbers; None for other laws, whose kernels then know nothing of it."""
    law = specimen.contact
    if not isinstance(law, PowerLaw):
        return None
    terms = law.terms
    exponents = [1, *(exponent for exponent, _ in terms)]
    halves = [(after - before) // 2 for before, after in pairwise(exponents)]
    padding = MOST_TERMS - len(terms)
    return PowerTerms(
        1.0 / float(law.reference),
        (*halves, *[0] * padding),
        (*(float(force) for _, force in terms), *[0.0] * padding),
    )
