from ._base_motion import (
    sampled_motion as sampled_motion,
)
from ._cubic_run import (
    integrate_cubics as integrate_cubics,
)
from ._flow_derivative import (
    flow_derivative as flow_derivative,
)
from ._integrate import (
    MAX_IMPACT_RATE_HZ as MAX_IMPACT_RATE_HZ,
    ROUNDING as ROUNDING,
    Impacts as Impacts,
    Trajectory as Trajectory,
    check_impact_rate as check_impact_rate,
    check_times as check_times,
    check_within as check_within,
    integrate as integrate,
    start_motion as start_motion,
)
from ._poincare import (
    smallest_period as smallest_period,
    state_scales as state_scales,
    stroboscopic_section as stroboscopic_section,
)
from ._response import (
    WHOLE as WHOLE,
    Response as Response,
    steady_response as steady_response,
    whole_periods as whole_periods,
)
from ._sample_by_sample import (
    FollowedMotion as FollowedMotion,
    follow_samples as follow_samples,
)
