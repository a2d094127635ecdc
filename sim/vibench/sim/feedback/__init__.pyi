from ._branch import (
    Begin as Begin,
    BranchHold as BranchHold,
    branch_hold as branch_hold,
    branch_multipliers as branch_multipliers,
    impact_branch as impact_branch,
    motion_slopes as motion_slopes,
)
from ._law import (
    LawWeights as LawWeights,
    LinearLaw as LinearLaw,
    designed_law as designed_law,
    pd_law as pd_law,
)
from ._loop import (
    loop_multiplier as loop_multiplier,
    loop_transfer as loop_transfer,
)
from ._plant import (
    LoopTiming as LoopTiming,
    SampledPlant as SampledPlant,
)
from ._stability import (
    OpenLoopMultiplier as OpenLoopMultiplier,
    PerturbedMotion as PerturbedMotion,
    envelope_deviation as envelope_deviation,
    open_loop_multiplier as open_loop_multiplier,
)
