from ._client import (
    AdoptedEngine as AdoptedEngine,
    Announcement as Announcement,
    Attendant as Attendant,
    EngineClient as EngineClient,
    EngineProcess as EngineProcess,
    StopDelivery as StopDelivery,
    announced_engines as announced_engines,
    out_of_reach as out_of_reach,
    programs_to_stop as programs_to_stop,
    programs_without_engine as programs_without_engine,
    require_ended as require_ended,
    start_engine as start_engine,
    stop_engine as stop_engine,
    the_engine as the_engine,
    unattended_engine as unattended_engine,
)
from ._engine import (
    Engine as Engine,
    JobQueue as JobQueue,
)
from ._published_state import (
    SampleSlice as SampleSlice,
)
from ._request_handler import (
    RequestHandler as RequestHandler,
)
from ._server import (
    serving as serving,
)
from ._status import (
    DRIVING as DRIVING,
    LONGEST_PATIENCE_S as LONGEST_PATIENCE_S,
    VIEWER_PATIENCE_S as VIEWER_PATIENCE_S,
    ArmedPlan as ArmedPlan,
    BenchFacts as BenchFacts,
    EngineMessage as EngineMessage,
    EngineState as EngineState,
    EngineStatus as EngineStatus,
    MessageKind as MessageKind,
    RowStatus as RowStatus,
    RunStatus as RunStatus,
    Supervision as Supervision,
    TwinStatus as TwinStatus,
    TwinSwitch as TwinSwitch,
)
from ._verbs import (
    CampaignRequest as CampaignRequest,
)
from ._wire import (
    EngineError as EngineError,
    EngineGone as EngineGone,
    EngineSilent as EngineSilent,
)
