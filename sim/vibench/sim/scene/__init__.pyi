from ._measured_cost import (
    learn_cost as learn_cost,
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
    EscapeRate as EscapeRate,
    Share as Share,
    wilson_share as wilson_share,
)
from ._solve import (
    solve_ensemble as solve_ensemble,
    solve_scene as solve_scene,
)
