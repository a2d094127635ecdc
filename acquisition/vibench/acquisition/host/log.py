"""What instruments are told and what is noted in recordings, for Python's logging; silent unless asked."""

import logging

LOG = logging.getLogger("vibench.acquisition")
LOG.addHandler(logging.NullHandler())
