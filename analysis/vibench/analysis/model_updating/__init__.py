"""The specimen that is really on the shaker, fitted to the recordings of one campaign.

Damping and frequencies come from the weakest noise, the gap from where sweeps begin to collide or from
two dwells that bracket it. Every value has its bounds; what could not be told is said.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
