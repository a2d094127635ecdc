"""A result as one JSON document: every number with its unit in its name, and its uncertainty beside it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..chaos import MotionVerdict
from ..frequency_response import NoiseAnalysis, PeriodicFrequencyResponse, Resonance, distortion
from ..model import CurveDifference, SimulatedRun
from ..recordings import RecordingFacts
from ..sine import CollisionRegion, Collisions, Edge, TerminalLevel, level_summary
from ._campaign_results import (
    CampaignResults,
    DwellResult,
    NoiseResult,
    Result,
    SteppedSineResult,
    SweepResult,
)

Json = dict[str, Any]


def result_summary(result: Result) -> Json:
    """Say a result in numbers that JSON can hold; what is not finite becomes null."""
    document: Json = {
        "recording": _facts(result.analysis.facts),
        "checks": [
            {"what": each.what, "verdict": each.verdict.value, "text": each.text}
            for each in result.analysis.checks
        ],
    }
    match result:
        case NoiseResult():
            document |= {"kind": "noise", "measured": _noise(result)}
        case SweepResult():
            document |= {"kind": "sweep", "measured": _sweep(result)}
        case DwellResult():
            document |= {"kind": "dwell", "measured": _dwell(result)}
        case SteppedSineResult():
            document |= {"kind": "stepped_sine", "measured": _stepped(result)}
    document["simulated"] = _simulated(result)
    plain: Json = _plain(document)
    return plain


def campaign_summary(results: CampaignResults) -> Json:
    """Say all results of a campaign, and what failed."""
    return {
        "campaign": results.name,
        "results": [result_summary(each) for each in results.results],
        "failures": [{"recording": f.name, "what": f.what, "error": f.sentence} for f in results.failures],
    }


def _facts(facts: RecordingFacts) -> Json:
    return {
        "name": facts.name,
        "path": str(facts.path),
        "state": facts.state.value,
        "reason": facts.reason,
        "origin": facts.origin.value,
        "started_utc": facts.started_utc,
        "bench_check": facts.bench_check,
        "recording_id": facts.recording_id,
        "duration_s": facts.duration_s,
        "sample_rate_hz": facts.sample_rate_hz,
        "requested_sample_rate_hz": facts.requested_sample_rate_hz,
        "excitation": facts.measurement.excitation.model_dump(mode="json"),
        "overload_s": dict(facts.overload_s),
        "lost_samples": facts.lost_samples,
        "feedback": [
            {"kind": each.kind, "time_s": time_s, **each.numbers}
            for time_s, each in zip(facts.feedback_s, facts.feedback, strict=True)
        ],
    }


def _noise(result: NoiseResult) -> Json:
    found = result.analysis.response
    return {
        "resonances": [_resonance(each) for each in found.resonances],
        "transmission": _frequency_response(result.analysis),
        "distortion": None if found.periodic is None else _distortion(found.periodic),
        "independent_averages": found.frequency_response.n_eff,
        "used_s": found.used_s,
        "left_out": found.left_out,
        "lost_samples": found.lost_samples,
        "overloaded_samples": found.overloaded_samples,
        "median_coherence": float(np.median(found.frequency_response.coherence)),
        "base_rms_acceleration_m_per_s2": found.base_level.rms_acceleration,
        "base_rms_displacement_m": found.base_level.rms_displacement_m,
        "relative_sd_base_rms": found.base_level.relative_sd,
    }


def _frequency_response(analysis: NoiseAnalysis) -> Json:
    view = analysis.request.view
    found = view.shown(analysis.response.frequency_response)
    how = found.settings
    return {
        "quantity": view.name,
        "unit": view.unit,
        "estimator": how.estimator.value,
        "noise_ratio": how.noise_ratio,
        "window": how.window,
        "segment_s": how.segment_samples / how.sample_rate_hz,
        "overlap": how.overlap,
        "resolution_hz": found.resolution_hz,
        "segments_used": found.segments_used,
        "segments_excluded": found.segments_excluded,
        "delay_removed_s": how.delay_s,
        "confidence": how.confidence,
        "coherence_significance": found.coherence_significance,
        "frequency_hz": found.frequency_hz,
        "magnitude": found.magnitude,
        "magnitude_lower": found.magnitude_lower,
        "magnitude_upper": found.magnitude_upper,
        "phase_rad": found.phase_rad,
        "phase_lower_rad": found.phase_lower,
        "phase_upper_rad": found.phase_upper,
        "coherence": found.coherence,
    }


def _distortion(periodic: PeriodicFrequencyResponse) -> Json:
    found = distortion(periodic)
    return {
        "realisations": periodic.realisations,
        "median_noise_over_magnitude": found.noise_share,
        "median_distortion_over_magnitude": found.distortion_share,
        "odd_detection_lines_m_per_s": found.odd_m_per_s,
        "even_detection_lines_m_per_s": found.even_m_per_s,
        "noise_on_detection_lines_m_per_s": found.detection_noise_m_per_s,
    }


def _resonance(found: Resonance) -> Json:
    return {
        "frequency_hz": found.frequency_hz,
        "sd_frequency_hz": found.sd_frequency_hz,
        "damping_ratio": found.damping_ratio,
        "sd_damping_ratio": found.sd_damping_ratio,
        "peak_frequency_hz": found.peak_frequency_hz,
        "peak_magnitude": found.peak_magnitude,
        "sd_peak_magnitude": found.sd_peak_magnitude,
        "is_resolved": bool(found.is_resolved),
    }


def _sweep(result: SweepResult) -> Json:
    found = result.analysis.response
    top = int(np.argmax(found.response_ii))
    return {
        "start_hz": float(found.frequency_hz[0]),
        "stop_hz": float(found.frequency_hz[-1]),
        "sweep_rate_hz_per_s": found.sweep_rate_hz_per_s,
        "drive_amplitude_start_m": float(found.drive_amplitude_m[0]),
        "drive_amplitude_stop_m": float(found.drive_amplitude_m[-1]),
        "largest_response_i": float(np.max(found.response_i)),
        "largest_response_ii": float(found.response_ii[top]),
        "largest_response_ii_at_hz": float(found.frequency_hz[top]),
        "collision_regions": _regions(result.analysis.collisions),
        "jumps": [
            {
                "frequency_hz": each.frequency_hz,
                "lower_hz": each.lower_hz,
                "upper_hz": each.upper_hz,
                "time_s": each.time_s,
                "before": each.before,
                "after": each.after,
                "decibel": each.decibel,
            }
            for each in result.analysis.jumps
        ],
    }


def _regions(found: Collisions) -> list[Json]:
    return [_region(each) for each in found.regions]


def _region(region: CollisionRegion) -> Json:
    return {
        "start": _edge(region.start),
        "stop": _edge(region.stop),
        "reaches_start_of_sweep": region.reaches_start,
        "reaches_stop_of_sweep": region.reaches_stop,
    }


def _edge(edge: Edge) -> Json:
    return {
        "frequency_hz": edge.frequency_hz,
        "time_s": edge.time_s,
        "lower_hz": edge.lower_hz,
        "upper_hz": edge.upper_hz,
    }


def _dwell(result: DwellResult) -> Json:
    found = result.analysis.response
    return {
        "frequency_hz": found.drive.frequency_hz,
        "sd_frequency_hz": found.drive.sd_frequency_hz,
        "drive_amplitude_m": found.drive.amplitude_m,
        "sd_drive_amplitude_m": found.drive.sd_amplitude_m,
        "drive_distortion": found.drive.distortion,
        "window_s": found.window_s,
        "response_i": found.response_i,
        "noise_bias_i": found.noise_bias_i,
        "response_ii": found.response_ii,
        "sd_response_ii": found.sd_response_ii,
        "phase_rad": found.phase_rad,
        "sd_phase_rad": found.sd_phase_rad,
        "lines": [
            {
                "label": each.label,
                "frequency_hz": each.frequency_hz,
                "amplitude_m": each.amplitude_m,
                "sd_amplitude_m": each.sd_amplitude_m,
                "decibel_re_drive_line": each.decibel,
            }
            for each in found.lines
        ],
        "terminal_bands": [_band(each) for each in result.analysis.terminal],
        "motion": _motion(result.analysis.motion.verdict),
    }


def _motion(verdict: MotionVerdict) -> Json:
    evidence = verdict.evidence
    exponent, sd_exponent = evidence.exponent_per_s or (None, None)
    return {
        "kind": verdict.kind.value,
        "why": verdict.why,
        "period": verdict.period,
        "periods_judged": evidence.periods,
        "is_settled": evidence.is_settled,
        "scatter_over_orbit": evidence.spread,
        "noise_over_orbit": evidence.noise,
        "zero_one_k": None if evidence.zero_one is None else evidence.zero_one.k,
        "surrogates_p": None if evidence.surrogates is None else evidence.surrogates.p,
        "turns_per_period": None if evidence.rotation is None else evidence.rotation.turns_per_period,
        "lyapunov_per_s": exponent,
        "sd_lyapunov_per_s": sd_exponent,
    }


def _band(found: TerminalLevel) -> Json:
    return {
        "towards_hz": found.towards_hz,
        "low_hz": found.low_hz,
        "high_hz": found.high_hz,
        "peak_hz": found.peak_hz,
        "rms_m": found.rms_m,
        "relative_sd": found.relative_sd,
        "decibel_re_drive_line": found.decibel,
    }


def _stepped(result: SteppedSineResult) -> Json:
    found = result.analysis.response
    return {
        "frequency_hz": found.frequency_hz,
        "direction": found.direction,
        "drive_amplitude_m": found.drive_amplitude_m,
        "response_i": found.response_i,
        "noise_bias_i": found.noise_bias_i,
        "response_ii": found.response_ii,
        "sd_response_ii": found.sd_response_ii,
        "left_out": found.left_out,
        **level_summary(result.analysis.excitation, found),
    }


def _simulated(result: Result) -> Json | None:
    found: Json
    match result:
        case NoiseResult(laid=laid) if laid is not None:
            found = {"resonances": [_resonance(each) for each in laid.response.resonances]}
        case SweepResult(laid=laid) if laid is not None:
            found = {"collision_regions": _regions(laid.collisions)}
        case DwellResult(laid=laid) if laid is not None:
            found = {
                "response_i": laid.response.response_i,
                "response_ii": laid.response.response_ii,
                "sd_response_ii": laid.response.sd_response_ii,
                "response_i_measured_over_simulated_db": laid.response_i_db,
                "terminal_bands": [_band(each) for each in laid.terminal],
            }
        case SteppedSineResult(laid=laid) if laid is not None:
            found = {"response_i": laid.response.response_i, "response_ii": laid.response.response_ii}
        case _:
            return None
    return {**_run(laid.run), "difference": _difference(laid.difference), **found}


def _run(run: SimulatedRun) -> Json:
    return {
        "drive": "recorded base motion",
        "base_band_hz": [run.base_low_hz, run.base_high_hz],
        "accuracy": run.accuracy.value,
        "masses_kg": run.specimen.masses,
        "stiffnesses_n_per_m": run.specimen.stiffnesses,
        "dampings_ns_per_m": run.specimen.dampings,
        "gap_m": run.specimen.gap_m,
        "impacts": run.impacts,
        "impact_rate_hz": run.impact_rate_hz,
    }


def _difference(found: CurveDifference) -> Json:
    return {
        "median_abs_db": found.median_abs_db,
        "rms_db": found.rms_db,
        "share_within_two_standard_errors": found.share_within_two,
    }


def _plain(value: Any) -> Any:
    """Turn numpy's numbers into Python's, and what is not finite into None: JSON has neither."""
    match value:
        case bool() | str() | int() | None:
            return value
        case float():
            return float(value) if math.isfinite(value) else None
        case np.ndarray():
            return _plain(value.tolist())
        case np.generic():
            return _plain(value.item())
        case Mapping():
            return {str(key): _plain(each) for key, each in value.items()}
        case Sequence():
            return [_plain(each) for each in value]
        case _:
            raise TypeError(f"{type(value).__name__} has no place in a summary; turn it into numbers first")
