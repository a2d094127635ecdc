from ._errors import InvalidStudy as InvalidStudy, StudyError as StudyError
from ._executor import (
    Executor as Executor,
    Solver as Solver,
    ThreadExecutor as ThreadExecutor,
    software as software,
)
from ._grid import (
    COLUMNS as COLUMNS,
    MESSAGE as MESSAGE,
    NUMBERS as NUMBERS,
    Cell as Cell,
    Column as Column,
    Grid as Grid,
    GridPlan as GridPlan,
    PointState as PointState,
    StudyAxis as StudyAxis,
)
from ._queue import (
    Points as Points,
    StudyEnd as StudyEnd,
    run_points as run_points,
)
from ._results import (
    GridResults as GridResults,
    Plan as Plan,
    StudyResults as StudyResults,
    open_study as open_study,
    read_arrays as read_arrays,
    read_plan as read_plan,
    read_sessions as read_sessions,
)
from ._solve import (
    ExistingStudy as ExistingStudy,
    executor_of as executor_of,
    planned_work_s as planned_work_s,
    run_study as run_study,
    solve_study as solve_study,
    store_of as store_of,
)
from ._store import (
    Arrays as Arrays,
    MemoryStore as MemoryStore,
    PointAnswer as PointAnswer,
    Store as Store,
    prediction_at as prediction_at,
)
from ._study import (
    GivenStart as GivenStart,
    Start as Start,
    Study as Study,
    StudyObservable as StudyObservable,
    TargetError as TargetError,
    TargetTime as TargetTime,
    frequency_range as frequency_range,
    plausibility_warnings as plausibility_warnings,
    study_solver as study_solver,
)
