from ._measured_cost import (
    expected_cost_s as expected_cost_s,
    learn_cost as learn_cost,
    longest_cost_s as longest_cost_s,
    measure_cost as measure_cost,
)
from ._plan import (
    ScenePlan as ScenePlan,
    plan_scene as plan_scene,
)
from ._prediction import (
    Ensemble as Ensemble,
    FoundMotion as FoundMotion,
    Method as Method,
    MotionKind as MotionKind,
    ScenePrediction as ScenePrediction,
    StartMemory as StartMemory,
)
from ._scene import (
    BUDGET_S as BUDGET_S,
    AutomaticDuration as AutomaticDuration,
    FixedDuration as FixedDuration,
    Given as Given,
    Observable as Observable,
    Rest as Rest,
    Scene as Scene,
)
from ._shares import (
    UNSURE as UNSURE,
    Count as Count,
    EscapeRate as EscapeRate,
    Share as Share,
    shares_of as shares_of,
    wilson_share as wilson_share,
)
from ._side_by_side import (
    Solved as Solved,
    settle_in_lanes as settle_in_lanes,
    settle_scenes as settle_scenes,
    solve_in_lanes as solve_in_lanes,
    solve_scenes as solve_scenes,
)
from ._solve import (
    settle_scene as settle_scene,
    solve_ensemble as solve_ensemble,
    solve_scene as solve_scene,
)
from ._states_alone import (
    lanes_are_worth_it as lanes_are_worth_it,
)
