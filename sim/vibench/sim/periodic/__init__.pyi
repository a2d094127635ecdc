from ._balance_branch import (
    balance_branch_within as balance_branch_within,
    orbit_guess as orbit_guess,
)
from ._balance_solver import (
    BalanceOptions as BalanceOptions,
    balance as balance,
    first_order_guesses as first_order_guesses,
)
from ._branch import (
    NEUTRAL as NEUTRAL,
    BifurcationKind as BifurcationKind,
    Branch as Branch,
    BranchEvent as BranchEvent,
    Parameter as Parameter,
)
from ._branch_following import (
    parameter_value as parameter_value,
)
from ._condensation import (
    LinearStructure as LinearStructure,
    structure_of as structure_of,
)
from ._continuation import (
    ArcEnd as ArcEnd,
    ArcSteps as ArcSteps,
)
from ._drive_path import (
    AmplitudePath as AmplitudePath,
    DrivePath as DrivePath,
    FrequencyPath as FrequencyPath,
)
from ._first_order_balance import (
    FirstOrderState as FirstOrderState,
    first_order_states as first_order_states,
)
from ._floquet import (
    multipliers as multipliers,
)
from ._harmonic_balance import (
    Balance as Balance,
    BalanceEnd as BalanceEnd,
    HarmonicSet as HarmonicSet,
)
from ._orbit_branch import (
    periodic_branch as periodic_branch,
    periodic_branch_within as periodic_branch_within,
)
from ._period_map import (
    OrbitShape as OrbitShape,
    PeriodMap as PeriodMap,
)
from ._phase_reference import (
    PhaseReference as PhaseReference,
)
from ._phase_resonance import (
    phase_resonance_branch as phase_resonance_branch,
)
from ._restoring_force import (
    PowerSpring as PowerSpring,
    RestoringForce as RestoringForce,
    spring_of as spring_of,
)
from ._shooting import (
    PeriodicOrbit as PeriodicOrbit,
    ShootingEnd as ShootingEnd,
    periodic_orbit as periodic_orbit,
)
