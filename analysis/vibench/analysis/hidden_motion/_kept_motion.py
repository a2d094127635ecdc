"""The hidden motion kept in its recording: channels over time and a row for each impact, for any reader."""

import numpy as np

from vibench.acquisition.recording import Recording, ResultArray

from ..recordings.channels import BASE, RESPONSE
from ..signals.arrays import Samples
from ._hidden_motion import HiddenMotion

RESULT = "hidden_motion"
_TIME, _IMPACT, _FREE = "time", "impact_time", "free_impact_time"


def keep_hidden_motion(recording: Recording, motion: HiddenMotion) -> str:
    """Save a hidden motion beside the samples it came from; gives the name of the result.

    Exports take it along (`vibench export --results`). Not followed samples are NaN.

    Raises
    ------
    RecordingError
        When the recording is not finished, or the disk refuses.

    """
    arrays = {**_channels(motion), **_tracked_impacts(motion), **_free_impacts(motion)}
    settings = {"told": motion.to_dict(), "sentences": list(motion.sentences)}
    return recording.save_results(RESULT, arrays, settings, (BASE, RESPONSE))


def _channels(motion: HiddenMotion) -> dict[str, ResultArray]:
    def along(values: Samples, unit: str) -> ResultArray:
        return ResultArray(values.astype(np.float32, copy=False), unit, (_TIME,))

    return {
        _TIME: ResultArray(motion.time_s, "s"),
        "p": along(motion.tracked.p, "m"),
        "p_sd": along(motion.tracked.p_sd, "m"),
        "p_rate": along(motion.tracked.rate, "m s-1"),
        "p_without_contact_model": along(motion.free.p, "m"),
        "p_without_contact_model_sd": along(motion.free.p_sd, "m"),
    }


def _tracked_impacts(motion: HiddenMotion) -> dict[str, ResultArray]:
    found = motion.tracked.collisions
    return {
        _IMPACT: ResultArray((motion.first_sample + found.samples) / motion.sample_rate_hz, "s"),
        "impact_side": ResultArray(found.sides, "1", (_IMPACT,)),
        "impact_impulse": ResultArray(found.impulses, "N s", (_IMPACT,)),
        "impact_penetration": ResultArray(found.penetrations_m, "m", (_IMPACT,)),
        "impact_duration": ResultArray(found.durations_s, "s", (_IMPACT,)),
        "impact_speed_before": ResultArray(found.speeds_before, "m s-1", (_IMPACT,)),
        "impact_speed_after": ResultArray(found.speeds_after, "m s-1", (_IMPACT,)),
    }


def _free_impacts(motion: HiddenMotion) -> dict[str, ResultArray]:
    found = motion.free.impacts
    return {
        _FREE: ResultArray((motion.first_sample + found.samples) / motion.sample_rate_hz, "s"),
        "free_impact_side": ResultArray(found.sides, "1", (_FREE,)),
        "free_impact_impulse": ResultArray(found.impulses, "N s", (_FREE,)),
        "free_impact_p": ResultArray(found.p, "m", (_FREE,)),
    }
