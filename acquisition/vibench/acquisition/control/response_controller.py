"""Holding the amplitude of a response: the setting follows what m0 does, frequency by frequency."""

from math import pi

import numpy as np

from vibench.sim import PhaseReference

from ..excitation.held_response import HeldResponse
from ..plan import RunState, look_s
from ..recording import Held, HeldResponseNote
from .control_action import Controller
from .feedback_channels import require_answer
from .level_control import measured_level
from .sine_loop import SineLoop, glided

_PROMPT = 0.8
"""Part of the error, in decibels, that is corrected at once."""
_IN_A_ROW = 2


def hold_response(loop: SineLoop, plan: HeldResponse) -> Controller[None]:
    """Begin quietly, bring m0 to its amplitude at every frequency, record, ramp down."""
    passes = tuple(plan.passes())
    loop.change(passes[0][1][0], loop.bounded_vpp(plan.start_share * loop.most_vpp))
    yield from loop.listen_to_silence()
    yield from loop.ramp_up()
    for direction, frequencies_hz in passes:
        for frequency_hz in frequencies_hz:
            if frequency_hz != loop.setting.frequency_hz:
                yield from glided(loop, frequency_hz, None, plan.glide_step_hz)
            yield from _brought(loop, plan)
            yield from _recorded(loop, plan, frequency_hz, direction)
    yield from loop.ramp_down()
    yield from loop.say()


def _brought(loop: SineLoop, plan: HeldResponse) -> Controller[None]:
    """Correct the setting until the response is as asked, or the wait is over."""
    frequency_hz, waited_s, in_a_row = loop.setting.frequency_hz, 0.0, 0
    stretch_s = look_s(frequency_hz)
    while in_a_row < _IN_A_ROW and waited_s + stretch_s <= plan.longest_wait_s:
        yield from loop.listen(RunState.SETTLING, stretch_s)
        waited_s += stretch_s
        response_m, _, base = response_of(loop, plan)
        require_answer(loop.rig, frequency_hz, loop.setting.setting_vpp, base)
        wanted = plan.response_m / max(response_m, 1e-15)
        in_a_row = in_a_row + 1 if abs(wanted - 1) <= plan.tolerance else 0
        change = min(max(wanted**_PROMPT, 1 / plan.most_change), plan.most_change)
        # The newest look alone: what was before answers another setting.
        if in_a_row == 0:
            loop.change(frequency_hz, loop.bounded_vpp(change * loop.setting.setting_vpp))
        else:
            loop.forget()


def response_of(loop: SineLoop, plan: HeldResponse) -> tuple[float, float, float]:
    """Give the response [m], m0 over base, and the base's acceleration [m/s2]: amplitudes, newer half."""
    periods, frequency_hz = loop.periods, loop.setting.frequency_hz
    newer = slice(periods.count // 2, None)
    base, response = periods.base[newer], periods.response[newer, 1]
    acceleration = abs(complex(np.mean(base)))
    ratio = loop.channels.transmissibility(base, response, frequency_hz)
    against = 1.0 if plan.response_of is PhaseReference.RELATIVE else 0.0
    response_m = abs(ratio - against) * acceleration / (2 * pi * frequency_hz) ** 2
    return response_m, abs(ratio), acceleration


def _recorded(loop: SineLoop, plan: HeldResponse, frequency_hz: float, direction: str) -> Controller[None]:
    loop.forget()
    yield from loop.listen(RunState.RECORDING, plan.record_s, plan.segment(frequency_hz, direction))
    response_m, ratio, _ = response_of(loop, plan)
    base = measured_level(loop.periods.base)
    is_held = abs(response_m / plan.response_m - 1) <= 2 * plan.tolerance
    loop.note(
        HeldResponseNote(
            frequency_hz=frequency_hz,
            response_m=response_m,
            response_ii=ratio,
            base_m_per_s2=base.amplitude,
            base_u=base.uncertainty,
            setting_vpp=loop.setting.setting_vpp,
            level=Held.WITHIN if is_held else Held.OUTSIDE,
        )
    )
