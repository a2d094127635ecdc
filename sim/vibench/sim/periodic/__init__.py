"""Motions that repeat, stable or not: harmonic balance, shooting, their branches, Floquet multipliers.

`first_order_states` is the paper's analytical solution (Gong et al. 2025, eqs. 4 and 5), all branches of
it; `harmonic_balance_branch` follows balances of any number of harmonics, `periodic_branch` exact motions
with impacts, along frequency or amplitude, through folds (pseudo-arclength continuation). Stability:
multipliers of the variational equation, which also tell folds, period doublings and Neimark-Sacker points.
The spring is a `RestoringForce` of p, the rest a linear structure condensed to p (Krack and Gross 2019).
"""

from ._balance_branch import harmonic_balance_branch
from ._condensation import (
    structure_of,
)
from ._first_order_balance import first_order_states, jump_frequencies
from ._floquet import (
    multipliers,
)
from ._orbit_branch import (
    periodic_branch,
)
from ._restoring_force import (
    PowerSpring,
    spring_of,
)
from ._shooting import (
    periodic_orbit,
)

__all__ = [
    "PowerSpring",
    "first_order_states",
    "harmonic_balance_branch",
    "jump_frequencies",
    "multipliers",
    "periodic_branch",
    "periodic_orbit",
    "spring_of",
    "structure_of",
]
