"""A dwell before it is measured: the described rig under the plan's voltage, begun in several ways."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import HeldDwell, Measurement, base_motion
from vibench.acquisition.rig import Rig, RigModel, amplifier_of, shaker_of, specimen_of
from vibench.sim.shaker.loaded_shaker import LoadedShaker, MotionFailed

from ..errors import AnalysisError
from ..sine.dwell import DwellResponse, dwell_response
from .quantities import of_one_draw

STEADY = 1e-4
"""Scatter over size below which a simulated motion repeats."""
_SETTLED_S = 2.5
_EDGE_PERIODS = 80
"""At each end, which integration disturbs."""
_FINEST_STEP_HZ = 51_200.0
_SURELY_OTHER = 5.0
"""Standard errors by which runs differ that have settled on different motions."""


@dataclass(frozen=True)
class SimulatedDwell:
    """Windows of the rig under a sine, from several starts."""

    sd_largest: float
    """Of Response I, relative; 0 where nothing collides."""
    sd_second: float
    """Of Response II, relative; 0 where nothing collides."""
    has_several_motions: bool
    """Whether some runs collide and others do not, or they differ by more than chance."""


def simulated_dwell(
    measurement: Measurement, rig: Rig, at_hz: float, window_s: float
) -> SimulatedDwell | None:
    """Move amplifier, table and specimen by the plan's voltage, and analyse that like a recording.

    Begun more gently than the generator's staircase begins it, and harder: where both end in one motion, so
    will what is measured. None where a motion is lost, or the window is too short to be analysed.
    """
    per_period = 2 * int(np.ceil(_FINEST_STEP_HZ / at_hz / 2))
    phase = 2 * np.pi * (np.arange(per_period) + 0.5) / per_period
    volts = _terminal_v(measurement, rig, at_hz) * np.sinc(1 / per_period) * np.sin(phase)
    lengths_s = (measurement.ramp_s + _SETTLED_S, window_s + 2 * _EDGE_PERIODS / at_hz)
    settling, window = (np.tile(volts, round(length_s * at_hz)) for length_s in lengths_s)
    rising = min(round(measurement.ramp_s * at_hz) * per_period, settling.size)
    gentle = np.concatenate([np.linspace(0.0, 1.0, rising) * settling[:rising], settling[rising:]])
    specimen, found = specimen_of(rig), []
    gap_m = min((each for each in specimen.gaps_m if np.isfinite(each)), default=0.0)
    begun = ((gentle, 0.0), (settling, 0.5), (settling, -0.5))
    for beginning, off in begun:
        start = (0.0, off * gap_m, 0.0, 0.0, 0.0, 0.0)
        shaken = LoadedShaker(amplifier_of(rig), shaker_of(rig), specimen, 1 / (per_period * at_hz), start)
        try:
            shaken.move(beginning)
            before = shaken.impacts
            motion = shaken.move(window)
            if shaken.impacts == before:
                continue
            channels = (window, motion.base_acceleration, motion.m0_velocity)
            drive, base, response = (each.reshape(-1, 2).mean(axis=1) for each in channels)
            rate_hz = per_period * at_hz / 2
            found.append(dwell_response(drive, base, response, rate_hz, near_hz=at_hz, window_s=window_s))
        except (MotionFailed, AnalysisError):
            return None
    if not found:
        return SimulatedDwell(0.0, 0.0, has_several_motions=False)
    size = np.array([each.response_ii for each in found])
    largest, second = np.sqrt(np.mean(np.square([_scatter(each) for each in found]), axis=0))
    differ = np.ptp(size) > _SURELY_OTHER * np.sqrt(2) * max(second, STEADY) * np.mean(size)
    return SimulatedDwell(
        float(largest), float(second), has_several_motions=bool(len(found) < len(begun) or differ)
    )


def _scatter(found: DwellResponse) -> tuple[float, float]:
    """Give the relative scatter of both Responses, as the analysis will tell it."""
    # What does not repeat and is small passes for noise.
    like_noise = float(np.nan_to_num(found.noise_error_i)) / found.response_i
    chance = of_one_draw(found).relative or 0.0
    return float(np.hypot(like_noise, chance)), found.sd_response_ii / found.response_ii


def _terminal_v(measurement: Measurement, rig: Rig, at_hz: float) -> float:
    """Peak at the terminal: as set, or as feedback will set it for the level that it holds."""
    excitation = measurement.excitation
    if not isinstance(excitation, HeldDwell):
        return 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    held_m = base_motion(excitation, rig, np.array([at_hz])).amplitude_m
    return float(RigModel(rig).volts_for((2 * np.pi * at_hz) ** 2 * held_m, at_hz)[0])
