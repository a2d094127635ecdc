"""What the sensors do to a motion on its way into a recording, as far as the bench configuration says it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vibench.acquisition.recording import ChannelHeader, coupling_cut_hz

from ..signals.arrays import Complexes, Reals

ACCELEROMETER_DAMPING_RATIO = 0.02
"""Of a piezoelectric accelerometer's mounted resonance; usual for the kind."""


def sensor_gain(bench: Mapping[str, Any], channel: ChannelHeader, frequency_hz: Reals) -> Complexes:
    """Complex gain of a channel over the motion that it shows, shape (lines,); 1 at low frequency.

    The channel's delay as its header says it; of the base's accelerometer the mounted resonance, of the
    vibrometer the bandwidth, whose own delay is part of the header's. A converter's coupling is left out.
    """
    s = 2j * np.pi * frequency_hz
    delay_s = channel.delay_s
    gain: Complexes = np.ones(frequency_hz.size, dtype=np.complex128)
    match channel.quantity:
        case "acceleration" if (resonance_hz := _number(bench, "accelerometer", "resonance_hz")) is not None:
            part = frequency_hz / resonance_hz
            gain = np.asarray(1 / (1 - part**2 + 2j * ACCELEROMETER_DAMPING_RATIO * part))
        case "velocity" if (bandwidth_hz := _number(bench, "vibrometer", "bandwidth_hz")) is not None:
            gain = np.asarray(1 / (1 + 1j * frequency_hz / bandwidth_hz))
            delay_s -= 1 / (2 * np.pi * bandwidth_hz)
    return np.asarray(gain * np.exp(-s * delay_s))


def coupled_gain(bench: Mapping[str, Any], channel: ChannelHeader, frequency_hz: Reals) -> Complexes:
    """Give the same with the channel's coupling, above 0 Hz."""
    coupling = 1j * frequency_hz / (1j * frequency_hz + coupling_cut_hz(channel.coupling))
    return np.asarray(sensor_gain(bench, channel, frequency_hz) * coupling)


def _number(bench: Mapping[str, Any], section: str, key: str) -> float | None:
    said = (bench.get(section) or {}).get(key)
    return float(said) if isinstance(said, int | float) and said > 0 else None
