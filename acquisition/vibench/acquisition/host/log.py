"""Logger for messages to instruments and events of recordings; off by default."""

import logging

LOG = logging.getLogger("vibench.acquisition")
LOG.addHandler(logging.NullHandler())
