from ._chain import (
    MOST_CELLS as MOST_CELLS,
    Chain as Chain,
    chain_of as chain_of,
)
from ._dispersion import (
    BandGap as BandGap,
    band_frequencies_hz as band_frequencies_hz,
    band_gaps as band_gaps,
    bloch_factor as bloch_factor,
    chain_transmissibility as chain_transmissibility,
)
from ._integrate import (
    ChainImpacts as ChainImpacts,
    ChainTrajectory as ChainTrajectory,
    integrate_chain as integrate_chain,
)
from ._lyapunov import (
    ChainExponent as ChainExponent,
    chain_lyapunov_exponent as chain_lyapunov_exponent,
)
from ._response import (
    ChainResponse as ChainResponse,
    MeanEnergies as MeanEnergies,
    chain_energies as chain_energies,
    chain_response as chain_response,
    mean_energies as mean_energies,
)
from ._target import (
    TargetedResponse as TargetedResponse,
    chain_response_to as chain_response_to,
)
