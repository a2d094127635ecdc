"""What is worked out about a test in another process: its outlook, and what the specimen will do."""

from dataclasses import dataclass

from vibench.acquisition.plan import Measurement, Outlook, outlook
from vibench.acquisition.rig import Rig
from vibench.analysis import Foresight, foresee


@dataclass(frozen=True)
class Ahead:
    """A test on a rig."""

    measurement: Measurement
    rig: Rig


def looked_ahead(ahead: Ahead) -> Outlook:
    """Work out signal, loads, time and size."""
    return outlook(ahead.measurement, ahead.rig)


def foreseen(ahead: Ahead) -> Foresight:
    """Simulate what the specimen will do."""
    return foresee(ahead.measurement, ahead.rig)
