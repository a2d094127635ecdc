"""A live view for a run that begins: channels from the bench, the band from the plan."""

import numpy as np

from vibench.acquisition.engine import BenchFacts
from vibench.acquisition.plan import Campaign, Measurement, lead_in_s
from vibench.acquisition.rig import Rig
from vibench.analysis.live import LiveChannel, LiveView

WHOLE_BAND_HZ = (20.0, 2000.0)
"""Looked at when the plan is not known: it was armed by somebody else."""
WARM_RATE_HZ, WARM_S, WARM_HZ = 51200.0, 3.0, 200.0


def live_view(bench: BenchFacts, rig: Rig | None, campaign: Campaign | None, name: str) -> LiveView:
    """Begin to watch the run of the recording ``name``."""
    measurement = measurement_called(campaign, name)
    band_hz = WHOLE_BAND_HZ if measurement is None else measurement.excitation.band_hz
    channels = [
        LiveChannel(each.role, each.unit, each.units_per_volt, each.full_scale_v) for each in bench.channels
    ]
    delay_s = 0.0 if rig is None else rig.vibrometer.delay_s
    begins_s = 0.0 if measurement is None else lead_in_s(measurement)
    return LiveView(channels, bench.sample_rate_hz, band_hz=band_hz, delay_s=delay_s, lead_in_s=begins_s)


def warm_up() -> None:
    """Watch a moment of silence and a sine, so that everything is loaded and every window is known."""
    roles = ("drive_voltage", "base_acceleration", "m0_velocity")
    channels = [LiveChannel(role, "V", 1.0, 1.0) for role in roles]
    view = LiveView(channels, WARM_RATE_HZ, band_hz=WHOLE_BAND_HZ)
    time_s = np.arange(round(WARM_S * WARM_RATE_HZ)) / WARM_RATE_HZ
    sine = np.sin(2 * np.pi * WARM_HZ * time_s)
    view.add(0, np.tile(sine, (len(roles), 1)).astype(np.float32))
    view.time_histories(1.0, 100)
    view.spectrum()
    view.frequency_response()
    view.portrait()


def measurement_called(campaign: Campaign | None, name: str) -> Measurement | None:
    """Find the measurement that a recording is one of."""
    if campaign is None:
        return None
    return next((each for recording, each in campaign.recordings() if recording == name), None)
