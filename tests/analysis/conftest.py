"""Recordings for the analysis tests: made once, of a specimen whose response is known."""

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import Dwell, SteppedSine, StreamedNoise

A0_WEAK, A0_STRONG = 0.5e-6, 5e-6
DELAY_SAMPLES = 1
SETTLE_S, DWELL_S = 2.0, 3.0
SWEEP = {"start_hz": 225.0, "stop_hz": 305.0, "duration_s": 16.0}


@pytest.fixture(scope="session")
def dwell_motions():
    """Base and velocity of a weak and a colliding dwell at 260 Hz."""
    found = {}
    for name, amplitude_m in (("weak", A0_WEAK), ("strong", A0_STRONG)):
        motion = synthetic.sine(SETTLE_S + DWELL_S, 260.0, amplitude_m)
        found[name] = (motion, *synthetic.response_of(motion, DELAY_SAMPLES))
    return found


def dwell_plan(amplitude_m, duration_s=DWELL_S):
    return Dwell(
        amplitude_vpp=2 * synthetic.VOLTS_PER_METRE * amplitude_m,
        frequency_hz=260.0,
        settle_s=SETTLE_S,
        duration_s=duration_s,
    )


DWELL_PART = synthetic.Part("dwell", SETTLE_S, SETTLE_S + DWELL_S, {"frequency_hz": 260.0})


@pytest.fixture(scope="session")
def dwell_file(dwell_motions, tmp_path_factory):
    """Return a function that writes a complete or shortened dwell to a new folder."""

    def write(level="weak", **how):
        motion, velocity, _ = dwell_motions[level]
        plan = dwell_plan({"weak": A0_WEAK, "strong": A0_STRONG}[level])
        delay_s = DELAY_SAMPLES / synthetic.RATE
        return synthetic.write_recording(
            tmp_path_factory.mktemp("dwell"),
            plan,
            motion,
            velocity,
            [DWELL_PART],
            **{"name": level, "delay_s": delay_s, **how},
        )

    return write


@pytest.fixture(scope="session")
def sweep_file(tmp_path_factory):
    """Write a sweep through the collision region, slow enough for a clear jump."""
    return synthetic.write_sweep(tmp_path_factory.mktemp("sweep"), A0_STRONG, SWEEP)[0]


@pytest.fixture(scope="session")
def noise_motion():
    """Plan, base motion, m0 velocity and parts of two consecutive realisations of weak noise."""
    return synthetic.noise_from_rest(1e-8, settle_s=3.0)


@pytest.fixture(scope="session")
def noise_file(noise_motion, tmp_path_factory):
    """Return a function that writes complete or shortened noise to a new folder."""

    def write(**how):
        folder = tmp_path_factory.mktemp("noise")
        return synthetic.write_recording(folder, *noise_motion, **{"name": "noise", **how})

    return write


@pytest.fixture(scope="session")
def stepped_file(tmp_path_factory):
    """Write two upward steps of a stepped sine, each from rest and known in closed form."""
    frequencies = (150.0, 180.0)
    motions = [synthetic.sine(4.0, each, A0_WEAK) for each in frequencies]
    base = synthetic.joined(motions)
    velocity = np.concatenate([synthetic.response_of(each)[0] for each in motions])
    parts = [
        synthetic.Part("step", 4.5 * n + 2.5, 4.5 * n + 3.5, {"frequency_hz": each, "direction": "up"})
        for n, each in enumerate(frequencies)
    ]
    plan = SteppedSine(amplitude_vpp=0.05, frequencies_hz=frequencies, settle_s=2.5, record_s=1.0)
    folder = tmp_path_factory.mktemp("stepped")
    return synthetic.write_recording(folder, plan, base, velocity, parts, name="stepped")


STREAMED = {"band_start_hz": 40.0, "band_stop_hz": 600.0, "duration_s": 20.0}


@pytest.fixture(scope="session")
def streamed_noise():
    """20 s of streamed noise whose transmission is 2 at every frequency: plan, base, velocity, parts."""
    base, velocity = synthetic.noise_band(STREAMED["duration_s"], 20.0, 700.0, 1e-6, 5)
    plan = StreamedNoise(amplitude_vpp=0.1, settle_s=0.0, seed=1, **STREAMED)
    return plan, base, velocity, [synthetic.Part("noise", 0.0, STREAMED["duration_s"], {})]


@pytest.fixture(scope="session")
def streamed_file(streamed_noise, tmp_path_factory):
    """Return a function that writes complete or shortened streamed noise to a new folder."""

    def write(**how):
        folder = tmp_path_factory.mktemp("streamed")
        plan, base, velocity, parts = streamed_noise
        velocity = how.pop("velocity", velocity)
        return synthetic.write_recording(folder, plan, base, velocity, parts, **{"name": "streamed", **how})

    return write
