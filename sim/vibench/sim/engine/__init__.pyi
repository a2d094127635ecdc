from ._batch import (
    BatchedMotion as BatchedMotion,
    batches_pay as batches_pay,
    follow_batch as follow_batch,
    is_batchable as is_batchable,
)
from ._collision_shapes import (
    ABOUT_MIDDLE as ABOUT_MIDDLE,
    BY_DAMPER as BY_DAMPER,
    BY_JERK as BY_JERK,
    BY_PRESS as BY_PRESS,
    BY_SPRING as BY_SPRING,
    DEEPER as DEEPER,
    DEPTHS as DEPTHS,
    DURATION as DURATION,
    END_ONTO_DURATION as END_ONTO_DURATION,
    HALF_FORCE as HALF_FORCE,
    HARDEST as HARDEST,
    HEIGHTS as HEIGHTS,
    LASTS_BY as LASTS_BY,
    ONTO_DURATION as ONTO_DURATION,
    POINTS as POINTS,
    SHARES as SHARES,
    SOFTEST as SOFTEST,
    SPACING as SPACING,
    TERMS as TERMS,
    TO_DURATION as TO_DURATION,
    collision_shapes as collision_shapes,
)
from ._cubic_run import (
    CubicRun as CubicRun,
    cubic_tables as cubic_tables,
    start_on_cubics as start_on_cubics,
)
from ._library import (
    FOLDER as FOLDER,
    Engine as Engine,
    EngineError as EngineError,
    library_path as library_path,
)
from ._power_shapes import (
    AT_END as AT_END,
    AT_START as AT_START,
    POINTS_AT as POINTS_AT,
    POWER_SHARES as POWER_SHARES,
)
from ._processor import (
    usable_families as usable_families,
)
from ._run import (
    DIRECTIONS as DIRECTIONS,
    MOST_IMPACTS as MOST_IMPACTS,
    MOST_STEPS as MOST_STEPS,
    SPARE_IMPACTS as SPARE_IMPACTS,
    GrowthReadings as GrowthReadings,
    NativeRun as NativeRun,
    RunRecord as RunRecord,
    Watch as Watch,
    check_known_answer as check_known_answer,
    most_impacts as most_impacts,
    native_engine as native_engine,
    refuse_inside_a_stop as refuse_inside_a_stop,
)
from ._scene import (
    collision_structure as collision_structure,
    fill_cell as fill_cell,
    fill_drive as fill_drive,
    fill_power as fill_power,
    fill_specimen as fill_specimen,
    power_structure as power_structure,
    scene_of as scene_of,
)
from ._sources import (
    physics_digest as physics_digest,
)
from ._structures import (
    Structure as Structure,
    parse_structures as parse_structures,
)
