"""Campaigns of short dwells, simulated faults, and the outcomes of campaign points."""

from vibench.acquisition.campaign import read_journal
from vibench.acquisition.campaign._journal import journal_path
from vibench.acquisition.plan import Campaign, Dwell, Measurement, RetryPolicy, RunState


def dwell(name, frequency_hz=260.0, amplitude_vpp=1.0):
    excitation = Dwell(amplitude_vpp=amplitude_vpp, frequency_hz=frequency_hz, settle_s=0.1, duration_s=0.2)
    return Measurement(name=name, excitation=excitation, ramp_s=0.3, ramp_step_s=0.03)


def campaign(*names, rest_s=0.0, **policy):
    measurements = tuple(dwell(name) for name in names)
    return Campaign(name="c", rest_s=rest_s, measurements=measurements, retry=RetryPolicy(**policy))


def points(folder):
    return read_journal(journal_path(folder, "c"))


def states(folder):
    return [point.state.value for point in points(folder)]


def outcomes(point_results):
    return [(each.name, each.outcome.value) for each in point_results]


def fail_one_read(bench, fault, name=None):
    """Return a progress callback that lets one read raise ``fault`` during a recording (of ``name``)."""
    faults = [fault]

    def watch(progress):
        if faults and progress.run.state is RunState.RECORDING and name in (None, progress.name):
            bench.world.faults["digitizer.read"] = [faults.pop]

    return watch
