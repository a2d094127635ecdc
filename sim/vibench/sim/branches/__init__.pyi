from ._branches import (
    UPDATES_TO_HOLD as UPDATES_TO_HOLD,
    BranchOrigin as BranchOrigin,
    FoundBranch as FoundBranch,
    balanced_branches as balanced_branches,
    growth_time_s as growth_time_s,
    least_growth_time_s as least_growth_time_s,
    shot_branches as shot_branches,
)
from ._motion_search import (
    MotionSearch as MotionSearch,
    periodic_motions as periodic_motions,
    random_state as random_state,
)
