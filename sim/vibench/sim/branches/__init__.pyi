from ._branches import (
    UPDATES_TO_HOLD as UPDATES_TO_HOLD,
    BranchOrigin as BranchOrigin,
    FoundBranch as FoundBranch,
    balance_branches as balance_branches,
    growth_time_s as growth_time_s,
    least_growth_time_s as least_growth_time_s,
    shoot_branches as shoot_branches,
)
from ._motion_search import (
    MotionSearch as MotionSearch,
    periodic_motions as periodic_motions,
    random_state as random_state,
)
