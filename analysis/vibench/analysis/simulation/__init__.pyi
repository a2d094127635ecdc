from ._accuracy_cost import (
    cost_sentences as cost_sentences,
)
from ._map_request import (
    MapPicture as MapPicture,
    MapRequest as MapRequest,
    MotionRequest as MotionRequest,
    SettledMotion as SettledMotion,
    settled_motion as settled_motion,
)
from ._progress import (
    MOTION_COLUMNS as MOTION_COLUMNS,
    SimulationProgress as SimulationProgress,
)
from ._request import (
    PartialResult as PartialResult,
    SimulationRequest as SimulationRequest,
    Trouble as Trouble,
)
from ._worker import (
    Asked as Asked,
    Begin as Begin,
    Cancel as Cancel,
    Ended as Ended,
    Grown as Grown,
    Order as Order,
    serve as serve,
)
