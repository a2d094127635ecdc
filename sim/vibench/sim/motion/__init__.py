"""One motion of one specimen: integrated, observed, sampled, or reduced to once a drive period.

`integrate` gives a `Trajectory`; `steady_response` Responses I and II over the window at the end of a run;
`response_curve` those over frequency; `follow_samples` a motion sample by sample of a recorded base. Also
the stroboscopic map with its scales (`poincare`) and the flow over a stretch with its derivative. A run
that cannot go on ends with an `Outcome`, not an exception (docs/decisions/0004-contact-integration.md).
"""

from ._flow_derivative import (
    flow_derivative,
)
from ._integrate import (
    MAX_IMPACT_RATE_HZ,
    ROUNDING,
    SPARE_IMPACTS,
    integrate,
    new_record,
    start_motion,
)
from ._poincare import (
    smallest_period,
    state_scales,
    stroboscopic_section,
)
from ._response import (
    WHOLE,
    Response,
    steady_response,
    whole_periods,
)
from ._response_curve import (
    response_curve,
)
from ._sample_by_sample import (
    follow_samples,
)
from ._trajectory import (
    Trajectory,
)

__all__ = [
    "MAX_IMPACT_RATE_HZ",
    "ROUNDING",
    "SPARE_IMPACTS",
    "WHOLE",
    "Response",
    "Trajectory",
    "flow_derivative",
    "follow_samples",
    "integrate",
    "new_record",
    "response_curve",
    "smallest_period",
    "start_motion",
    "state_scales",
    "steady_response",
    "stroboscopic_section",
    "whole_periods",
]
