"""What it costs to follow a motion on the machine of docs/accuracy.md: the measure of a budget. SI units.

It is not measured where it runs: the same scene with the same budget has the same answer everywhere.
"""

from ..model.contact_law import ContactLaw
from ..model.linear_gap import LinearGap
from ..model.power_law import PowerLaw

FLIGHT, STEPS = 5e-5, 3.5e-4
"""Seconds for a second between contacts, and for one under a force at every p."""
HERTZ_IMPACT, LINEAR_IMPACT = 0.9e-6, 2.5e-6
"""Seconds for an impact: whole, by Gauss points, and step by step."""
HERTZ_TANGENT, TANGENT = 4.0, 1.6
"""With a small change carried along; a collision is then resolved step by step."""
STRICT_TOLERANCE, STRICT = 1e-8, 5.0
"""Below this tolerance contacts cost so many times more."""
STEP = 1e-9
"""Seconds for a step of flight, at least: what counts where a mode is far faster than those of the paper."""


def nominal_cost_s(
    contact: ContactLaw, tolerance: float, length_s: float, impacts: int, changes: int, steps: int
) -> float:
    """Give the processor time for a stretch of motion with so many impacts, small changes and steps."""
    strict = STRICT if tolerance < STRICT_TOLERANCE else 1.0
    match contact:
        case PowerLaw():
            contacts_s, tangent = (STEPS - FLIGHT) * length_s, TANGENT
        case LinearGap():
            contacts_s, tangent = LINEAR_IMPACT * impacts, TANGENT
        case _:
            contacts_s, tangent = HERTZ_IMPACT * impacts, HERTZ_TANGENT
    by_motion_s = FLIGHT * length_s + contacts_s * strict * (tangent if changes else 1.0)
    return max(by_motion_s, STEP * steps)
