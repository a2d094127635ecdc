"""The force of a power law in the kernels of `vibench.sim.chain`.

The law is that of docs/decisions/0026-power-laws.md.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
