"""Sweeps: responses over frequency, where the masses collide, and what JSON says of them."""

from dataclasses import asdict

from vibench.acquisition.recording import SegmentLabel

from ..comparison.recording_curves import sweep_traces
from ..frequency_response.request import FrequencyResponseRequest
from ..model.draws import Draw
from ..model.overlay import SweepOverlay, sweep_endings, sweep_overlay, sweep_quantities
from ..model.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import measurement_checks
from ..recordings.facts import RecordingFacts, known_specimen
from ..sine.collision_region import CollisionRegion, Collisions, collisions
from ..sine.sweep import SweepResponse
from ..sine.sweep_analysis import Sweep, SweepAnalysis, measured_sweep, played_check, smooth_jumps
from ..tables import named
from ..uncertainty.quantities import sweep_budgets
from .analysis_kind import AnalysisKind, Json


def _analyse(
    facts: RecordingFacts, channels: Channels, plan: Sweep, _: FrequencyResponseRequest
) -> SweepAnalysis:
    response, picture = measured_sweep(channels, plan, known_specimen(facts.bench))
    colliding = collisions(response)
    jumps = smooth_jumps(response, colliding)
    checks = (*measurement_checks(facts), played_check(response, plan))
    return SweepAnalysis(facts, checks, plan, response, colliding, jumps, picture)


def _draw(analysis: SweepAnalysis, channels: SimulatedChannels) -> Draw[SweepResponse]:
    found, _ = measured_sweep(channels, analysis.excitation, known_specimen(analysis.facts.bench))
    colliding = collisions(found)
    impacts = channels.played_impacts(SegmentLabel.SWEEP)
    return Draw(found, sweep_quantities(found, colliding), sweep_endings(colliding), *impacts)


def _measured(analysis: SweepAnalysis) -> Json:
    found = analysis.response
    top = found.largest(found.response_ii)
    return {
        "start_hz": float(found.frequency_hz[0]),
        "stop_hz": float(found.frequency_hz[-1]),
        "sweep_rate_hz_per_s": found.sweep_rate_hz_per_s,
        "drive_amplitude_start_m": float(found.drive_amplitude_m[0]),
        "drive_amplitude_stop_m": float(found.drive_amplitude_m[-1]),
        "largest_response_i": float(found.response_i[found.largest(found.response_i)]),
        "largest_response_ii": float(found.response_ii[top]),
        "largest_response_ii_at_hz": float(found.frequency_hz[top]),
        "steady_over_swept_linear": found.steady_over_swept,
        "collision_regions": _regions(analysis.collisions),
        "collisions_not_determined_hz": analysis.collisions.too_fast_hz,
        "jumps": [
            {
                **named(each, "frequency_hz", "lower_hz", "upper_hz", "time_s", "before", "after", "decibel"),
            }
            for each in analysis.jumps
        ],
    }


def _regions(found: Collisions) -> list[Json]:
    return [_region(each) for each in found.regions]


def _region(region: CollisionRegion) -> Json:
    return {
        "start": asdict(region.start),
        "stop": asdict(region.stop),
        "reaches_start_of_sweep": region.reaches_start,
        "reaches_stop_of_sweep": region.reaches_stop,
    }


def _simulated(laid: SweepOverlay) -> Json:
    return {"collision_regions": _regions(laid.collisions)}


SWEEP = AnalysisKind(
    family="sweep",
    analyse=_analyse,
    draw=_draw,
    compared=lambda analysis: sweep_quantities(analysis.response, analysis.collisions),
    lay=sweep_overlay,
    curves=sweep_traces,
    measured=_measured,
    simulated=_simulated,
    budgets=sweep_budgets,
)
