from ._period import (
    Points as Points,
)
from ._verdict import (
    MotionKind as MotionKind,
    MotionVerdict as MotionVerdict,
    motion_verdict as motion_verdict,
)
