"""Analysis of one recording, chosen by its kind of excitation."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from vibench.acquisition.recording import Recording, open_recording
from vibench.sim.background import Observer, ignore_progress, stage

from ..errors import AnalysisError, UnusableData
from ..frequency_response.noise_response import DEFAULT_REQUEST
from ..frequency_response.request import FrequencyResponseRequest
from ..kinds.analyses import ANALYSES
from ..kinds.noise import NOISE_FAMILY
from ..recordings.channel_levels import require_moving_channels
from ..recordings.channels import RecordedChannels
from ..recordings.checks import AbstractAnalysis
from ..recordings.facts import recording_facts
from ..recordings.response import scanned_role
from ..uncertainty.expected import until_checks

CONTRADICTIONS = (ArithmeticError, LookupError, MemoryError, TypeError, ValueError)
"""Errors that calculations raise if the parts of a well-formed recording contradict each other."""


def analyse(
    recording: Recording | Path | str,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: Observer = ignore_progress,
    response: str | None = None,
) -> AbstractAnalysis[Any, Any]:
    """Analyse a recording, complete or not, by the kind of excitation in its plan.

    Raises AnalysisError, with one sentence that names the file, when nothing in it can be analysed.

    Parameters
    ----------
    recording
        An open recording, or its path. An interrupted or growing recording is analysed up to the samples that
        it contains when it is opened.
    request
        Estimator and resolution for noise; other excitations ignore it.
    observer
        Receives the progress.
    response
        Channel to analyse, such as ``"m2_velocity"``; by default the channel that measures m0, or in a scan
        the mass that the vibrometer measured.
    """
    if isinstance(recording, Path | str):
        with open_recording(Path(recording)) as opened:
            return analyse(opened, request, observer, response)
    name, response = recording.path.name, response or scanned_role(recording)
    facts = recording_facts(recording, stage(observer, f"{name}: looking at every channel"), response)
    try:
        channels = RecordedChannels(recording, stage(observer, f"{name}: analysing"), response)
        require_moving_channels(facts.channels, facts.response)
        plan = facts.measurement.excitation
        if channels.is_force and ANALYSES[plan.kind].family != NOISE_FAMILY:
            raise UnusableData(
                f"{facts.response} has results only for noise (the apparent mass); analyse a motion, "
                "or measure noise"
            )
        found: AbstractAnalysis[Any, Any] = ANALYSES[plan.kind].analyse(facts, channels, plan, request)
        found = replace(found, checks=(*found.checks, *until_checks(facts)))
    except AnalysisError as error:
        ended = f"{facts.state.value}" + (f": {facts.reason}" if facts.reason else "")
        raise type(error)(f"{recording.path.name} ({ended}): {error}") from error
    except CONTRADICTIONS as error:
        raise UnusableData(
            f"{recording.path.name} cannot be analysed: its samples and tables contradict its plan "
            f"({type(error).__name__}: {error}); read them with h5py"
        ) from error
    return found
