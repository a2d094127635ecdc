"""Which figures a report shows, in which order."""

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Any

from ..figures import (
    TRACKED_RESONANCE,
    DrawnFigure,
    SteppedLook,
    backbone_figure,
    bench_levels_figure,
    distortion_figure,
    dwells_figure,
    excitation_figure,
    hysteresis_figure,
    portraits_figure,
    stepped_sine_figure,
    sweep_figure,
    sweep_orders_figure,
    transmission_figure,
    transmission_levels_figure,
)
from ..kinds import AnyResult, DwellResult, NoiseResult, SteppedSineResult, SweepResult
from ..sine import tracked_resonances


def noise_figures(noise: Sequence[NoiseResult]) -> Iterator[DrawnFigure]:
    """Draw all levels in one, then each with its distortion."""
    if len(noise) > 1:
        yield transmission_levels_figure([each.analysis for each in noise])
    for each in noise:
        yield transmission_figure(each.analysis, each.laid)
        if each.analysis.response.periodic is not None:
            yield distortion_figure(each.analysis, each.analysis.response.periodic)


def sweep_figures(sweeps: Sequence[SweepResult]) -> Iterator[DrawnFigure]:
    """Draw each sweep, then those that went there and back over each other."""
    for sweep in sweeps:
        yield sweep_figure(sweep.analysis, sweep.laid)
        yield sweep_orders_figure(sweep.analysis)
    for up, down in _there_and_back(sweeps):
        yield hysteresis_figure(up.analysis, down.analysis)


def dwell_figures(dwells: Sequence[DwellResult]) -> Iterator[DrawnFigure]:
    """Draw the dwells at one frequency together."""
    for _, group in groupby(dwells, key=lambda each: each.analysis.excitation.frequency_hz):
        same = tuple(group)
        yield dwells_figure([(each.analysis, each.laid) for each in same])
        yield portraits_figure([each.analysis for each in same])


def stepped_figures(
    look: SteppedLook[Any],
) -> Callable[[Sequence[SteppedSineResult]], Iterator[DrawnFigure]]:
    """Draw a figure of each over what was stepped."""
    return lambda stepped: (stepped_sine_figure(each.analysis, each.laid, look) for each in stepped)


def tracked_figures(tracked: Sequence[SteppedSineResult]) -> Iterator[DrawnFigure]:
    """Draw each resonance over level, where one was found."""
    for each in tracked:
        if tracked_resonances(each.analysis.facts.feedback):
            yield backbone_figure(each.analysis, each.laid)
        else:
            yield stepped_sine_figure(each.analysis, each.laid, TRACKED_RESONANCE)


def _there_and_back(sweeps: Sequence[SweepResult]) -> Iterator[tuple[SweepResult, SweepResult]]:
    """Pair each sweep upwards with the first one downwards of the same level over some of its band."""
    for up in sweeps:
        plan = up.analysis.excitation
        for down in sweeps:
            other = down.analysis.excitation
            is_back = plan.start_hz < plan.stop_hz and other.start_hz > other.stop_hz
            overlaps = other.stop_hz < plan.stop_hz and other.start_hz > plan.start_hz
            if is_back and overlaps and plan.amplitude_vpp == other.amplitude_vpp:
                yield up, down
                break


def recording_figures(result: AnyResult) -> tuple[DrawnFigure, ...]:
    """Draw what was planned and what every channel recorded."""
    facts = result.analysis.facts
    return excitation_figure(facts.measurement), bench_levels_figure(facts)
