from ._base_force import (
    FORCE_TERMS as FORCE_TERMS,
    Cubic as Cubic,
    base_force as base_force,
    shifted as shifted,
)
from ._detection import (
    LARGEST_BOUND as LARGEST_BOUND,
    LONGEST_TURN as LONGEST_TURN,
    NEVER as NEVER,
    ROUNDING as ROUNDING,
    SERIES_TERMS as SERIES_TERMS,
    TOUCH as TOUCH,
    derivative_bound as derivative_bound,
    first_contact as first_contact,
    polynomial_at as polynomial_at,
    touched_side as touched_side,
)
from ._flight import (
    CLEAR as CLEAR,
    GRID_TURN as GRID_TURN,
    LIFTS_OFF as LIFTS_OFF,
    OUT_OF_RANGE as OUT_OF_RANGE,
    TOUCHES as TOUCHES,
)
from ._linear_series import (
    AT_X as AT_X,
    AT_Z as AT_Z,
    COSINE as COSINE,
    P_RATE as P_RATE,
    SINE as SINE,
    WIDE as WIDE,
    X_RATE as X_RATE,
    Z_RATE as Z_RATE,
    P as P,
    linear_series as linear_series,
)
from ._observer import (
    series_peak as series_peak,
)
from ._series import (
    fill_flight_series as fill_flight_series,
    place_on_series as place_on_series,
)
