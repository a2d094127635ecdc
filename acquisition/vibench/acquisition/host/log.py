"""Log of the messages to instruments and of the events of recordings; off by default."""

import logging

LOG = logging.getLogger("vibench.acquisition")
LOG.addHandler(logging.NullHandler())
