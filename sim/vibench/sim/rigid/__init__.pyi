from ._stop import (
    RESOLVED as RESOLVED,
    closed_gap as closed_gap,
    is_resolved as is_resolved,
    place_between_rigid_stops as place_between_rigid_stops,
    rebound as rebound,
)
