from ._basins import (
    KickStability as KickStability,
    UncertaintyExponent as UncertaintyExponent,
    kick_stability as kick_stability,
    uncertainty_exponent as uncertainty_exponent,
)
from ._expansion import (
    MapEstimate as MapEstimate,
    estimate_map as estimate_map,
    map_solver as map_solver,
)
from ._map import (
    QUANTITIES as QUANTITIES,
    Map as Map,
    Quantity as Quantity,
    Range as Range,
    Refinement as Refinement,
    Spacing as Spacing,
)
from ._results import (
    Audit as Audit,
    MapMotion as MapMotion,
    MapResults as MapResults,
    open_map as open_map,
)
from ._solve import (
    compute_map as compute_map,
    solve_map as solve_map,
)
