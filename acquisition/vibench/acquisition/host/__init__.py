"""What the computer provides: TOML files in and out, shipped files, processes.

`FrozenModel` is the base of every validated value; what a file says wrongly is refused with file, key,
what was given and what is allowed. Knows nothing of measurements.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
