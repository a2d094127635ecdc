from ._detection import (
    LARGEST_BOUND as LARGEST_BOUND,
    LONGEST_TURN as LONGEST_TURN,
    NEVER as NEVER,
    ROUNDING as ROUNDING,
    SERIES_TERMS as SERIES_TERMS,
    TOUCH as TOUCH,
    first_contact as first_contact,
    polynomial_at as polynomial_at,
    touched_side as touched_side,
)
from ._flight import (
    FORCE_TERMS as FORCE_TERMS,
    GRID_TURN as GRID_TURN,
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
