"""The 3-DOF vibro-impact specimen: masses, springs, dampers, gap and contact. SI units.

Spring and damper (k0, c0) connect m0 to the base with displacement U, (k2, c2) connect m2 to m0, and (k1, c1)
connect m1 to m2. m1 touches a stop on m2 when ``|p| = |y - z|`` reaches the gap. The coordinates (x, y, z)
are the absolute displacements of m0, m1, m2 (Gong et al. 2025, eq. 1).
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .contact_laws import ContactLaw, Elasticity, hertz_stiffness, law_by_name
from .drive import Harmonic
from .stops import Strict

X, Y, Z, VX, VY, VZ = range(6)
"""Indices of displacements and velocities in a state; the same with and without contact."""
Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
Triple = tuple[float, float, float]
Gaps = tuple[float, float]
"""Clearances of the stops at negative and at positive p = y - z [m]; one of them may be infinite."""


GAPS_M = 1e-15, 1e15
"""Smallest and largest clearance [m]; the results of much smaller or larger ones are only rounding errors."""


@dataclass(frozen=True)
class Specimen(Strict):
    """The specimen on the shaker. Element i of a triple is m_i, k_i or c_i of the paper."""

    OWN_UNITS: ClassVar = {
        "masses": "kg",
        "stiffnesses": "N m-1",
        "dampings": "N s m-1",
        "mass_matrix": "kg",
        "stiffness_matrix": "N m-1",
        "damping_matrix": "N s m-1",
    }
    """Units of attributes whose names contain no unit."""

    masses: Triple
    """Masses m0, m1, m2 [kg]."""
    stiffnesses: Triple
    """Stiffnesses k0, k1, k2 [N/m]."""
    dampings: Triple
    """Damping coefficients c0, c1, c2, zero or positive [N s/m]."""
    gap_m: float
    """Clearance between m1 and each stop at rest [m]; infinite if there is no stop at positive p."""
    contact: ContactLaw
    lower_gap_m: float | None = None
    """Clearance at negative p [m]; infinite without a stop on this side, None if equal to ``gap_m``."""

    def __post_init__(self) -> None:
        _refuse_unless_positive("mass m", "kg", self.masses)
        _refuse_unless_positive("stiffness k", "N/m", self.stiffnesses)
        for index, damping in enumerate(self.dampings):
            if not 0.0 <= damping < math.inf:
                raise ValueError(
                    f"Damping c{index} = {damping} N s/m is not allowed: it must be zero or positive."
                )
        (least, most), finite = GAPS_M, [each for each in self.gaps_m if each != math.inf]
        if not (finite and all(least <= each <= most for each in finite)):
            raise ValueError(
                f"Gap {self.gap_m if self.lower_gap_m is None else self.gaps_m} m is not allowed: "
                f"it must be from {least:g} to {most:g}, and finite at one stop or both; "
                'without stops, give the contact "linear".'
            )

    @property
    def gaps_m(self) -> Gaps:
        """Clearances of the stops at negative and at positive p, as positive numbers [m]."""
        return (self.gap_m if self.lower_gap_m is None else self.lower_gap_m), self.gap_m

    @property
    def mass_matrix(self) -> Floats:
        """Mass matrix M, shape (3, 3) [kg]."""
        return np.diag(np.asarray(self.masses, dtype=np.float64))

    @property
    def stiffness_matrix(self) -> Floats:
        """Stiffness matrix K without contact, shape (3, 3) [N/m]."""
        return links_matrix(self.stiffnesses)

    @property
    def damping_matrix(self) -> Floats:
        """Damping matrix C, shape (3, 3) [N s/m]."""
        return links_matrix(self.dampings)

    @property
    def natural_frequencies_hz(self) -> NDArray[np.float64]:
        """Undamped natural frequencies without contact, ascending, shape (3,) [Hz]."""
        return _natural_frequencies(self.mass_matrix, self.stiffness_matrix)

    @property
    def bound_frequencies_hz(self) -> NDArray[np.float64]:
        """Undamped natural frequencies with m1 stuck to m2, ascending, shape (2,) [Hz]."""
        mass, _, stiffness = bound_matrices(self)
        return _natural_frequencies(mass, stiffness)

    @property
    def damping_ratios(self) -> NDArray[np.float64]:
        """Damping ratio of each mode without contact, ordered by frequency, shape (3,).

        The ratio is ``-Re(s) / abs(s)`` for a complex pair of poles. Above 1 the mode does not oscillate.
        """
        root = np.sqrt(np.asarray(self.masses))
        values, vectors = np.linalg.eigh(self.stiffness_matrix / np.outer(root, root))
        damping = vectors.T @ (self.damping_matrix / np.outer(root, root)) @ vectors
        own = np.diag(damping)
        if np.all(np.abs(damping - np.diag(own)) <= _ROUNDING * np.max(own)):
            return np.asarray(own / (2.0 * np.sqrt(values)), dtype=np.float64)
        return _ratios_of_coupled_modes(np.diag(np.sqrt(values)), damping)


_ROUNDING = 1e-12


def _ratios_of_coupled_modes(own: Floats, damping: Floats) -> NDArray[np.float64]:
    """Return damping ratios of modes coupled by damping, from frequencies [rad/s] and modal damping [1/s]."""
    poles = np.linalg.eigvals(np.block([[np.zeros_like(own), own], [-own, -damping]]))
    still = np.sort(np.abs(poles[poles.imag == 0.0]))
    # In overdamped modes, pair the slowest pole with the fastest pole. The product of both poles is the
    # mode's squared frequency, and their sum is its damping.
    pairs = list(zip(still[: still.size // 2], still[: still.size // 2 - 1 : -1], strict=True))
    found = [(math.sqrt(slow * fast), 0.5 * (slow + fast) / math.sqrt(slow * fast)) for slow, fast in pairs]
    found += [(abs(pole), -pole.real / abs(pole)) for pole in poles if pole.imag > 0.0]
    return np.array([ratio for _, ratio in sorted(found)])


JOIN = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
"""Matrix, shape (3, 2), that maps (x, z) to (x, y, z) while m1 sticks to m2, without the constant gap."""


def bound_matrices(specimen: Specimen) -> tuple[Floats, Floats, Floats]:
    """Return M, C and K of the specimen while m1 sticks to m2, for the coordinates x and z.

    Returns
    -------
    tuple of ndarray
        M [kg], C [N s/m] and K [N/m], each of shape (2, 2).
    """
    whole = specimen.mass_matrix, specimen.damping_matrix, specimen.stiffness_matrix
    mass, damping, stiffness = (JOIN.T @ matrix @ JOIN for matrix in whole)
    return mass, damping, stiffness


PAPER_MASSES: Triple = (5.8e-3, 2.1e-3, 2.0e-3)
"""Masses m0, m1, m2 of Gong et al. 2025, section 2 [kg]."""
PAPER_FREQUENCIES_HZ: Triple = (322.0, 100.0, 390.6)
"""Frequency f_i of mass m_i on spring k_i alone, k_i = m_i (2 pi f_i)^2; section 2 of the paper."""
STEEL = Elasticity(206e9, 0.27)
"""Material of the sphere m1; section 2 of the paper."""
ALUMINIUM = Elasticity(67e9, 0.3)
"""Material of the stops; section 2 of the paper."""
PAPER_RADIUS_M = 4.4e-3
"""Radius of the sphere in the paper; a steel sphere of 2.1 g would have a radius of 4.0 mm."""


def gong2025(
    damping_time_s: float = 2e-5,
    gap_m: float | Gaps = 45e-6,
    contact: str = "hertz",
) -> Specimen:
    """Return the specimen of Gong et al. 2025, section 2.

    Raises ValueError when damping time, gap or contact law is not allowed.

    Parameters
    ----------
    damping_time_s
        Damping over stiffness, c_i = damping_time_s * k_i [s]. The paper does not state this value. Among the
        values tried, only the default reproduces both of the paper's statements on chaos.
    gap_m
        Clearance at each stop [m], or (lower, upper); a power law is fitted at the smaller clearance.
    contact
        Name of the contact law: ``"hertz"`` (the paper's stops), ``"linear"`` (no stops), ``"power:5"`` or
        others of `vibench.sim.specimen`.
    """
    if not 0.0 <= damping_time_s < math.inf:
        raise ValueError(f"Damping time {damping_time_s} s is not allowed: it must be zero or positive.")
    stiffness = hertz_stiffness(STEEL, ALUMINIUM, PAPER_RADIUS_M)
    if isinstance(gap_m, tuple) and len(gap_m) != len(("lower", "upper")):
        raise ValueError(f"Gap {gap_m} m is not allowed: give one clearance, or (lower, upper).")
    lower, upper = gap_m if isinstance(gap_m, tuple) else (None, gap_m)
    law = law_by_name(contact, stiffness, upper if lower is None else min(lower, upper))
    m0, m1, m2 = PAPER_MASSES
    f0, f1, f2 = PAPER_FREQUENCIES_HZ
    k0, k1, k2 = (m * (2.0 * math.pi * f) ** 2 for m, f in ((m0, f0), (m1, f1), (m2, f2)))
    return Specimen(
        masses=PAPER_MASSES,
        stiffnesses=(k0, k1, k2),
        dampings=(damping_time_s * k0, damping_time_s * k1, damping_time_s * k2),
        gap_m=upper,
        contact=law,
        lower_gap_m=lower,
    )


def _refuse_unless_positive(name: str, unit: str, values: Triple) -> None:
    for index, value in enumerate(values):
        if not 0.0 < value < math.inf:
            raise ValueError(
                f"The {name}{index} = {value} {unit} is not allowed: it must be positive and finite."
            )


def links_matrix(links: Triple) -> Floats:
    """Return the matrix for (x, y, z) of three links: base to m0, m2 to m1, and m0 to m2."""
    c0, c1, c2 = links
    return np.array([[c0 + c2, 0.0, -c2], [0.0, c1, -c1], [-c2, -c1, c1 + c2]])


def _natural_frequencies(mass: Floats, stiffness: Floats) -> NDArray[np.float64]:
    root = np.sqrt(np.diag(mass))
    values = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    return np.asarray(np.sqrt(values) / (2.0 * np.pi), dtype=np.float64)


def state_scales(specimen: Specimen, drive: Harmonic) -> Floats:
    """Return the scales of a state, shape (6,): smaller gap [m] and, for velocities, gap times 2 pi f."""
    speed = 2.0 * np.pi * drive.frequency_hz
    return min(specimen.gaps_m) * np.repeat([1.0, speed], 3)


def energy_metric(specimen: Specimen) -> Floats:
    """Return the matrix E, shape (6, 6); s' E s is twice the energy of a state s without contact."""
    metric = np.zeros((6, 6))
    metric[:3, :3], metric[3:, 3:] = specimen.stiffness_matrix, specimen.mass_matrix
    return metric
