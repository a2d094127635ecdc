"""The sine of a check: so small that the specimen touches no stop, and what the base may do under it."""

import numpy as np
from numpy.typing import NDArray

from ..excitation.steps import Segment, Tone
from ..recording import SegmentLabel
from ..rig import BaseQuantity, ComplexArray, Rig, RigModel
from ._measurement import Measurement
from ._schedule import (
    CHECK_FRACTION,
    CHECK_FREQUENCY_HZ,
    CHECK_LISTEN_S,
    CHECK_LOWEST_VPP,
    CHECK_QUIET_S,
    CHECK_SETTLE_S,
    Phase,
    RunState,
)

TOUCH_SHARE = 0.25
"""Of the gap that p may take while the check plays: a sine begun at once overshoots, and collisions last."""
_KNOWN_HZ: NDArray[np.float64] = np.linspace(0.97, 1.03, 25, dtype=np.float64) * CHECK_FREQUENCY_HZ
"""A specimen's resonances are known to some per cent, and beside one the base moves by decibels."""


def check_amplitude_vpp(wanted_vpp: float, rig: Rig) -> float:
    """Lower a check's sine until p stays within a quarter of the gap, down to 10 mV at least [V].

    Parameters
    ----------
    wanted_vpp
        Setting that would do without stops; never exceeded [V].
    rig
        Says what specimen stands on the table.

    """
    model = RigModel(rig)
    per_vpp = 0.5 * rig.generator.terminal_factor()
    p_m_per_vpp = per_vpp * float(np.max(np.abs(model.transfer(BaseQuantity.P, _KNOWN_HZ))))
    return min(wanted_vpp, max(TOUCH_SHARE * model.gap_m / p_m_per_vpp, CHECK_LOWEST_VPP))


def run_check_vpp(planned_vpp: float, rig: Rig) -> float:
    """Amplitude of a run's own check for a plan at ``planned_vpp``, never above it [V]."""
    return min(planned_vpp, check_amplitude_vpp(max(CHECK_FRACTION * planned_vpp, CHECK_LOWEST_VPP), rig))


def check_phases(measurement: Measurement, rig: Rig) -> tuple[Phase, Phase, Phase]:
    """Lay out the check of the bench: listen in silence, let a small sine settle, listen to it."""
    planned_vpp = measurement.excitation.amplitude_vpp
    amplitude_vpp = run_check_vpp(planned_vpp, rig)
    tone = Tone(CHECK_FREQUENCY_HZ, amplitude_vpp / planned_vpp)
    segment = Segment(
        SegmentLabel.CHECK, {"frequency_hz": CHECK_FREQUENCY_HZ, "amplitude_vpp": amplitude_vpp}
    )
    return (
        Phase(RunState.CHECKING, None, CHECK_QUIET_S, segment),
        Phase(RunState.CHECKING, tone, CHECK_SETTLE_S, segment),
        Phase(RunState.CHECKING, tone, CHECK_LISTEN_S, segment),
    )


def expected_under_check(
    rig: Rig, terminal_v: float, quantity: BaseQuantity = BaseQuantity.ACCELERATION
) -> ComplexArray:
    """Give what a check may find of a quantity, as phasors over the voltage's phase; shape (n,).

    One for each of some specimens whose resonances lie up to 3 % elsewhere; where p comes near a stop all the
    same, also with m1 held to m2.

    Parameters
    ----------
    terminal_v
        Peak at the generator's terminal [V].
    quantity
        Of base or specimen, which says the unit: SI, such as m/s2 for an acceleration.

    """
    model = RigModel(rig)
    free = terminal_v * model.transfer(quantity, _KNOWN_HZ)
    p_m = terminal_v * np.abs(model.transfer(BaseQuantity.P, _KNOWN_HZ))
    if np.max(p_m) < 2 * TOUCH_SHARE * model.gap_m:
        return free
    return np.concatenate([free, terminal_v * model.stuck_transfer(quantity, _KNOWN_HZ)])


def nearest_expected(measured: float, expected: ComplexArray) -> float:
    """Give the amplitude among what is expected that lies nearest to a measured one [m/s2].

    Parameters
    ----------
    measured
        Amplitude of the base [m/s2].
    expected
        As `expected_under_check` gives it, shape (n,) [m/s2].

    """
    sizes = np.abs(expected)
    return float(np.clip(measured, np.min(sizes), np.max(sizes)))
