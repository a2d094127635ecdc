"""Long records are analysed in blocks: memory is bounded, and progress is reported."""

import tracemalloc

import numpy as np
import pytest

from vibench.acquisition.plan import StreamedNoise
from vibench.analysis import FrequencyResponseRequest, analyse
from vibench.analysis.frequency_response.noise_response import streamed_response
from vibench.analysis.recordings.channels import Stretch

RATE = 51_200.0


class Endless:
    """Channels of noise that is generated on reading and not stored."""

    sample_rate_hz = RATE
    response_delay_s = 0.0
    is_force = False

    def __init__(self, duration_s):
        self.samples = round(duration_s * RATE)
        self.longest_read = 0

    def response_gain(self, frequency_hz):
        return np.ones(frequency_hz.size)

    def stretches(self, label):
        return (Stretch(0, self.samples, {}, True),)

    def read(self, start, stop):
        self.longest_read = max(self.longest_read, stop - start)
        drive = np.random.default_rng(start).standard_normal(stop - start)
        return np.stack((drive, drive, np.cumsum(drive) / RATE))

    def bridge_flags(self, start, stop):
        return np.zeros(stop - start, dtype=bool)

    def overload_flags(self, start, stop):
        return np.zeros(stop - start, dtype=bool)


def peak_bytes(duration_s):
    plan = StreamedNoise(
        amplitude_vpp=1.0, band_start_hz=50, band_stop_hz=600, settle_s=0, duration_s=duration_s, seed=1
    )
    channels = Endless(duration_s)
    tracemalloc.start()
    streamed_response(channels, plan, FrequencyResponseRequest(segment_s=1.0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak, channels


@pytest.mark.thorough
def test_a_four_times_longer_record_needs_no_more_memory():
    short, _ = peak_bytes(25.0)
    long, channels = peak_bytes(100.0)
    assert long < 1.1 * short
    assert channels.longest_read < channels.samples / 5


@pytest.mark.thorough
def test_the_progress_of_an_analysis_reports_every_stage_and_its_completed_share(streamed_file):
    heard = []
    analyse(streamed_file(), observer=heard.append)
    stages = ["streamed.h5: looking at every channel", "streamed.h5: analysing"]
    assert [each.note for each in heard if each.of == 0] == stages
    for stage in stages:
        shares = [each.done / each.of for each in heard if each.note == stage and each.of]
        assert shares == sorted(shares)
        assert shares[-1] == pytest.approx(1.0)
