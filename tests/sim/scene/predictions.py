"""Scenes of the paper's specimen, and the four responses of a prediction with their errors."""

import numpy as np

from vibench.sim import Harmonic, Scene, gong2025

RESPONSES = ("response_i", "response_ii", "relative_i", "relative_ii")


def scene_of(contact, frequency_hz, amplitude_m, damping_time_s=2e-5, **options):
    return Scene(gong2025(damping_time_s, contact=contact), Harmonic(frequency_hz, amplitude_m), **options)


def responses(found):
    return np.array([getattr(found, name) for name in RESPONSES])


def errors(found):
    return np.array([getattr(found, f"{name}_error") for name in RESPONSES])
