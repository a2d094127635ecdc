"""Frequency response, coherence and spectral densities of a recording, for programs that read functions."""

from dataclasses import replace

import numpy as np

from vibench.acquisition.recording import ChannelHeader
from vibench.acquisition.rig import Role

from ..errors import NotEnoughData
from ..exchange import Excerpt, FunctionAxis, FunctionType, UniversalFunction
from ..frequency_response import FrequencyResponseRequest, FrequencyResponseView, NoiseResponse
from ..kinds import ANALYSES, NOISE_FAMILY
from ..signals import Quantity
from ..spectra import DensitySums
from ._measurement_analysis import analyse

_RESOLUTION_HZ = 1.0
"""Of densities: segments of a second, Hann window, half overlapping."""
_UNITS = {Quantity.DISPLACEMENT: "m", Quantity.VELOCITY: "m/s", Quantity.ACCELERATION: "m/s2"}


def spectral_functions(excerpt: Excerpt, request: FrequencyResponseRequest) -> tuple[UniversalFunction, ...]:
    """Estimate what an excerpt holds as functions of frequency.

    The density of each of its channels over its stretch of time, by segments of a second; of noise also the
    frequency response from base to m0, over the whole recording as `analyse` estimates it, and its coherence.

    Parameters
    ----------
    excerpt
        Of a recording that is open.
    request
        How the frequency response is estimated, and of which quantities it is.

    Raises
    ------
    NotEnoughData
        When the excerpt is shorter than a second, or its analysis finds nothing.

    """
    densities = tuple(_density(excerpt, channel) for channel in excerpt.channels)
    played = excerpt.recording.plan.get("excitation", {}).get("kind", "")
    if played not in ANALYSES or ANALYSES[played].family != NOISE_FAMILY:
        return densities
    return (*_responses(analyse(excerpt.recording, request).response, request.view), *densities)


def _responses(response: NoiseResponse, view: FrequencyResponseView) -> tuple[UniversalFunction, ...]:
    found = view.shown(response.frequency_response)
    moved = _axis(Role.M0_VELOCITY, "m0", view.response)
    reference = _axis(Role.BASE_ACCELERATION, "base", view.base)
    note = f"estimator {found.settings.estimator.value}, {found.n_eff:.4g} averages"
    # A coherence has no unit: a program that turns metres into millimetres must leave it alone.
    bare, bare_reference = (replace(axis, quantity="", unit="NONE") for axis in (moved, reference))
    hz, kinds = found.frequency_hz, FunctionType
    return (
        UniversalFunction(kinds.FREQUENCY_RESPONSE, hz, found.value, moved, reference, note),
        UniversalFunction(kinds.COHERENCE, hz, found.coherence, bare, bare_reference, note),
    )


def _axis(role: Role, body: str, quantity: Quantity) -> FunctionAxis:
    return FunctionAxis(role.value, f"{body} {quantity.value}", quantity.value, _UNITS[quantity])


def _density(excerpt: Excerpt, channel: ChannelHeader) -> UniversalFunction:
    rate = excerpt.recording.sample_rate_hz
    segment = round(rate / _RESOLUTION_HZ)
    if excerpt.samples < segment:
        raise NotEnoughData(
            f"the densities have lines every {_RESOLUTION_HZ:g} Hz, for which a second is needed, and "
            f"{excerpt.samples / rate:.3g} s were chosen; choose more"
        )
    sums = DensitySums(rate, segment_samples=segment)
    for values in excerpt.channel_blocks(channel.role):
        valid = np.isfinite(values)
        sums.add(np.where(valid, values, 0.0), valid)
    found = sums.density()
    return UniversalFunction(
        FunctionType.DENSITY,
        found.frequency_hz,
        found.density,
        FunctionAxis(channel.role, channel.role, channel.quantity, f"({channel.unit})2/Hz"),
        FunctionAxis(),
        f"Hann window, {found.n_eff:.4g} averages",
    )
