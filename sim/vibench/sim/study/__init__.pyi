from ._answers import (
    prediction_at as prediction_at,
)
from ._arrays import (
    PointAnswer as PointAnswer,
)
from ._columns import (
    MESSAGE as MESSAGE,
)
from ._errors import (
    StudyError as StudyError,
)
from ._expansion import (
    planned_work_s as planned_work_s,
)
from ._frequency_range import (
    frequency_range as frequency_range,
)
from ._layout import (
    PointState as PointState,
)
from ._plausibility_warnings import (
    plausibility_warnings as plausibility_warnings,
)
from ._progress import (
    StudyObserver as StudyObserver,
    StudyProgress as StudyProgress,
)
from ._results import (
    StudyResults as StudyResults,
    open_study as open_study,
)
from ._run import (
    run_study as run_study,
)
from ._software import (
    PACKAGES as PACKAGES,
    software as software,
)
from ._solve import (
    ExistingStudy as ExistingStudy,
    solve_study as solve_study,
)
from ._store import (
    MemoryStore as MemoryStore,
)
from ._study import (
    GivenStart as GivenStart,
    Start as Start,
    Study as Study,
    StudyObservable as StudyObservable,
)
from ._threads import (
    ThreadExecutor as ThreadExecutor,
)
