from ._answers import (
    prediction_at as prediction_at,
)
from ._axes import (
    Grid as Grid,
    StudyAxis as StudyAxis,
)
from ._columns import (
    COLUMNS as COLUMNS,
    MESSAGE as MESSAGE,
    NUMBERS as NUMBERS,
    Cell as Cell,
    Column as Column,
)
from ._errors import (
    InvalidStudy as InvalidStudy,
    StudyError as StudyError,
)
from ._executor import (
    Executor as Executor,
    Solver as Solver,
)
from ._expansion import (
    continued_point as continued_point,
    end_phase as end_phase,
    failed_point as failed_point,
    planned_times as planned_times,
    planned_work_s as planned_work_s,
    predecessors as predecessors,
)
from ._file_reading import (
    Plan as Plan,
    read_arrays as read_arrays,
    read_plan as read_plan,
    read_sessions as read_sessions,
)
from ._layout import (
    PointState as PointState,
)
from ._point_scheduler import (
    GridPlan as GridPlan,
)
from ._results import (
    GridResults as GridResults,
    StudyResults as StudyResults,
    open_study as open_study,
)
from ._run import (
    StudyEnd as StudyEnd,
    run_points as run_points,
    run_study as run_study,
)
from ._software import (
    PACKAGES as PACKAGES,
    software as software,
)
from ._solve import (
    ExistingStudy as ExistingStudy,
    executor_of as executor_of,
    solve_study as solve_study,
    store_of as store_of,
)
from ._store import (
    Arrays as Arrays,
    MemoryStore as MemoryStore,
    PointAnswer as PointAnswer,
    Store as Store,
)
from ._study import (
    GivenStart as GivenStart,
    Start as Start,
    Study as Study,
    StudyObservable as StudyObservable,
    frequency_range as frequency_range,
    plausibility_warnings as plausibility_warnings,
)
from ._threads import (
    ThreadExecutor as ThreadExecutor,
)
