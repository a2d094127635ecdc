from ._bridge import (
    Bridge as Bridge,
)
from ._engine_line import (
    Starter as Starter,
    Urgency as Urgency,
)
from ._live_run import (
    measurement_called as measurement_called,
)
