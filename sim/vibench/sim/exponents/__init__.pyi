from ._blocking import (
    BlockedMean as BlockedMean,
    blocked_mean as blocked_mean,
)
from ._lyapunov import (
    LyapunovEstimate as LyapunovEstimate,
    Precision as Precision,
    lyapunov_exponent as lyapunov_exponent,
)
from ._lyapunov_spectrum import (
    lyapunov_spectrum as lyapunov_spectrum,
)
