from ._period import (
    STEADY as STEADY,
    Points as Points,
    shortest_period as shortest_period,
)
from ._verdict import (
    LARGEST_NOISE as LARGEST_NOISE,
    SMALL as SMALL,
    MotionKind as MotionKind,
    MotionVerdict as MotionVerdict,
    begin_of_last_motion as begin_of_last_motion,
    motion_verdict as motion_verdict,
)
