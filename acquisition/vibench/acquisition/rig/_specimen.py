"""The specimen of a rig as the simulation knows it."""

from vibench.sim import Specimen, gong2025

from ._configuration import Rig


def specimen_of(rig: Rig) -> Specimen:
    """Make the specimen that a rig describes."""
    config = rig.specimen
    return gong2025(damping_time_s=config.damping_time_s, gap_m=config.gap_m, contact=config.contact)
