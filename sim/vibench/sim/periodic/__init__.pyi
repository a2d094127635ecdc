from ._balance_branch import (
    harmonic_balance_branch as harmonic_balance_branch,
)
from ._condensation import (
    structure_of as structure_of,
)
from ._first_order_balance import (
    first_order_states as first_order_states,
    jump_frequencies as jump_frequencies,
)
from ._floquet import (
    multipliers as multipliers,
)
from ._orbit_branch import (
    periodic_branch as periodic_branch,
)
from ._restoring_force import (
    PowerSpring as PowerSpring,
    spring_of as spring_of,
)
from ._shooting import (
    periodic_orbit as periodic_orbit,
)
