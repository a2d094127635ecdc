"""Free motion between contacts: exact, with proof of the instant at which a stop is touched.

Under a harmonic drive a flight is a sum of turning and decaying phasors; on an interval of a sampled or
swept drive, one product with a matrix. A touch is excluded or found by a bound on the acceleration of p,
never by sampling (docs/decisions/0004-contact-integration.md). Peaks, lines at the drive frequency and the
variation of a flight are closed forms as well. Holds for every law but power laws, which act at every p.
"""

from ._base_force import (
    FORCE_TERMS,
    Cubic,
    base_force,
    shifted,
)
from ._detection import (
    LARGEST_BOUND,
    LONGEST_TURN,
    NEVER,
    ROUNDING,
    SERIES_TERMS,
    TOUCH,
    derivative_bound,
    first_contact,
    polynomial_at,
    touched_side,
)
from ._flight import (
    CLEAR,
    GRID_TURN,
    LIFTS_OFF,
    OUT_OF_RANGE,
    RUN_OF_STEPS,
    TOUCHES,
    FlightTables,
    begin_terms,
    drive_phasor,
    fill_base_force,
    flight_tables,
    fly,
    place_on_phasors,
    propagate_phasors,
    start_flight,
)
from ._linear_series import (
    AT_X,
    AT_Z,
    COSINE,
    P_RATE,
    SINE,
    WIDE,
    X_RATE,
    Z_RATE,
    P,
    linear_series,
    read_change,
    write_change,
)
from ._observer import (
    observe_flight,
    series_peak,
)
from ._series import (
    fill_flight_series,
    place_on_series,
)
from ._variation import (
    propagate_tangent_flight,
)

__all__ = [
    "AT_X",
    "AT_Z",
    "CLEAR",
    "COSINE",
    "FORCE_TERMS",
    "GRID_TURN",
    "LARGEST_BOUND",
    "LIFTS_OFF",
    "LONGEST_TURN",
    "NEVER",
    "OUT_OF_RANGE",
    "P_RATE",
    "ROUNDING",
    "RUN_OF_STEPS",
    "SERIES_TERMS",
    "SINE",
    "TOUCH",
    "TOUCHES",
    "WIDE",
    "X_RATE",
    "Z_RATE",
    "Cubic",
    "FlightTables",
    "P",
    "base_force",
    "begin_terms",
    "derivative_bound",
    "drive_phasor",
    "fill_base_force",
    "fill_flight_series",
    "first_contact",
    "flight_tables",
    "fly",
    "linear_series",
    "observe_flight",
    "place_on_phasors",
    "place_on_series",
    "polynomial_at",
    "propagate_phasors",
    "propagate_tangent_flight",
    "read_change",
    "series_peak",
    "shifted",
    "start_flight",
    "touched_side",
    "write_change",
]
