from ._blocking import (
    BlockedMean as BlockedMean,
    blocked_mean as blocked_mean,
)
from ._lyapunov import (
    ExponentVerdict as ExponentVerdict,
    LyapunovEstimate as LyapunovEstimate,
    Precision as Precision,
    lyapunov_exponent as lyapunov_exponent,
)
from ._lyapunov_spectrum import (
    LyapunovSpectrum as LyapunovSpectrum,
    lyapunov_spectrum as lyapunov_spectrum,
)
from ._tangent_run import energy_metric as energy_metric
