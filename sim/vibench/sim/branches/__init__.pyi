from ._balanced_branches import (
    balanced_branches as balanced_branches,
)
from ._found_branch import (
    BranchOrigin as BranchOrigin,
    FoundBranch as FoundBranch,
)
from ._motion_search import (
    MotionSearch as MotionSearch,
    periodic_motions as periodic_motions,
    random_state as random_state,
)
from ._shot_branches import (
    shot_branches as shot_branches,
)
