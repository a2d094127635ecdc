"""The specimen that is really on the shaker, fitted to the recordings of one campaign.

Damping and frequencies come from the weakest noise, the gap from where sweeps begin to collide or from
two dwells that bracket it. Every value has its bounds; what could not be told is said.
"""

from ._updated_specimen import UpdatedSpecimen, update_model

__all__ = [
    "UpdatedSpecimen",
    "update_model",
]
