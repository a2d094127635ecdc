from ._chain import (
    Chain as Chain,
    chain_of as chain_of,
)
from ._dispersion import (
    band_gaps as band_gaps,
    bloch_factor as bloch_factor,
)
from ._integrate import (
    integrate_chain as integrate_chain,
)
from ._lyapunov import (
    chain_lyapunov_exponent as chain_lyapunov_exponent,
)
from ._modes import (
    chain_transmissibility as chain_transmissibility,
)
from ._response import (
    chain_response as chain_response,
)
