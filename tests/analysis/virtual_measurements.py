"""Measurements on the shipped virtual rig."""

from vibench.acquisition import open_bench, run_measurement
from vibench.acquisition.plan import Measurement, WhiteNoise
from vibench.acquisition.rig import load_rig

RIG = load_rig("virtual_rig")


def weak_noise(realisations, settle_s):
    """Return weak noise that resolves every resonance."""
    band = {"band_start_hz": 50, "band_stop_hz": 600, "repetition_hz": 2}
    return WhiteNoise(amplitude_vpp=0.05, realisations=realisations, periods=2, settle_s=settle_s, **band)


def sampled_at(rate_hz, rig=RIG):
    """Return the rig with another sampling rate."""
    return rig.model_copy(update={"daq": rig.daq.model_copy(update={"sample_rate_hz": rate_hz})})


def simulated_with(rig=RIG, **virtual):
    """Return the rig with other values of its simulation."""
    return rig.model_copy(update={"virtual": rig.virtual.model_copy(update=virtual)})


def record(path, excitation, rig=RIG, *, ramp_s=0.3, **how):
    """Record a measurement in a file and return its path."""
    with open_bench(rig) as bench:
        run_measurement(bench, Measurement(name=path.stem, excitation=excitation, ramp_s=ramp_s), path, **how)
    return path
