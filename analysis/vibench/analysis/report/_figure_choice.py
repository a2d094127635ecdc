"""Which figures a report shows, in which order."""

from collections.abc import Iterator
from itertools import groupby

from ..figures import (
    DrawnFigure,
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
from ..results import CampaignResults, DwellResult, Result, SteppedSineResult, SweepResult
from ..sine import tracked_resonances


def result_figures(results: CampaignResults) -> Iterator[DrawnFigure]:
    """Draw what was found: transmissions, sweeps, dwells, stepped sines."""
    noise = results.noise
    if len(noise) > 1:
        yield transmission_levels_figure([each.analysis for each in noise])
    for each in noise:
        yield transmission_figure(each.analysis, each.laid)
        if each.analysis.response.periodic is not None:
            yield distortion_figure(each.analysis, each.analysis.response.periodic)
    for sweep in results.sweeps:
        yield sweep_figure(sweep.analysis, sweep.laid)
        yield sweep_orders_figure(sweep.analysis)
    for up, down in _there_and_back(results.sweeps):
        yield hysteresis_figure(up.analysis, down.analysis)
    for _, group in groupby(results.dwells, key=_dwell_frequency):
        dwells = tuple(group)
        yield dwells_figure([(each.analysis, each.laid) for each in dwells])
        yield portraits_figure([each.analysis for each in dwells])
    for stepped in results.stepped:
        yield _stepped_figure(stepped)


def _stepped_figure(stepped: SteppedSineResult) -> DrawnFigure:
    """Draw a tracked resonance over level, everything else over what was stepped."""
    if tracked_resonances(stepped.analysis.facts.feedback):
        return backbone_figure(stepped.analysis, stepped.laid)
    return stepped_sine_figure(stepped.analysis, stepped.laid)


def _there_and_back(sweeps: tuple[SweepResult, ...]) -> Iterator[tuple[SweepResult, SweepResult]]:
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


def _dwell_frequency(result: DwellResult) -> float:
    return result.analysis.excitation.frequency_hz


def recording_figures(result: Result) -> tuple[DrawnFigure, ...]:
    """Draw what was planned and what every channel recorded."""
    facts = result.analysis.facts
    return excitation_figure(facts.measurement), bench_levels_figure(facts)
