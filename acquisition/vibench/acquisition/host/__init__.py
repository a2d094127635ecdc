"""Services of the host computer: TOML files, shipped files, threads for work that may hang.

`FrozenModel` is the base of every validated value; an error in a file is reported with file, key, given value
and allowed values. This package contains nothing about measurements.
"""

import logging

LOG = logging.getLogger("vibench.acquisition")
"""Logger for messages to instruments and events of recordings; off by default."""
LOG.addHandler(logging.NullHandler())
