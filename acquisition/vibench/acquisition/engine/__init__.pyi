from ._announcement import (
    Announcement as Announcement,
    announced_engines as announced_engines,
    the_engine as the_engine,
)
from ._client import (
    EngineClient as EngineClient,
)
from ._engine import (
    Engine as Engine,
)
from ._errors import (
    EngineGone as EngineGone,
)
from ._heartbeat import (
    Pulse as Pulse,
)
from ._job_queue import (
    Work as Work,
)
from ._lock import (
    BenchLock as BenchLock,
)
from ._request_handler import (
    Desk as Desk,
)
from ._requests import (
    Orders as Orders,
)
from ._sample_buffer import (
    Glance as Glance,
)
from ._server import (
    hosted as hosted,
)
from ._start import (
    EngineProcess as EngineProcess,
    start_engine as start_engine,
)
from ._state import (
    DRIVING as DRIVING,
    Attendance as Attendance,
    EngineState as EngineState,
)
from ._status import (
    ArmedPlan as ArmedPlan,
    BenchFacts as BenchFacts,
    EngineMessage as EngineMessage,
    EngineStatus as EngineStatus,
    MessageKind as MessageKind,
    RowStatus as RowStatus,
    RunStatus as RunStatus,
)
