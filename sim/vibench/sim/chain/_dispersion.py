"""Waves in an endless chain of equal cells without contact: bands, gaps, decay from cell to cell. SI units.

Seen from its m0, the inner pair of a cell is one dynamic stiffness S(w). A wave x_n ~ exp(i mu n) then obeys

    2 (k0 + i w c0) (1 - cos mu) = w^2 m0 - S(w)

(Brillouin, Wave Propagation in Periodic Structures, 2nd ed. 1953, chapters IV and V, for the diatomic chain;
here the second mass is a resonator with one of its own.)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels import Complex
from ..model import Specimen


def bloch_factor(specimen: Specimen, frequency_hz: ArrayLike) -> Complex:
    """Ratio of the motion of a cell to that of the cell before, for the wave that goes (or decays) outwards.

    Parameters
    ----------
    specimen
        One cell; its contact law and gap play no part.
    frequency_hz
        Shape (n,) [Hz]; positive.

    Returns
    -------
    exp(i mu), shape (n,): magnitude 1 within a band without damping, below 1 in a gap or with damping.

    """
    omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
    if not bool(np.all(np.isfinite(omega) & (omega > 0.0))):
        msg = "Frequencies must be finite and positive, in Hz."
        raise ValueError(msg)
    m0, m1, m2 = specimen.masses
    outer, inner, middle = (
        stiffness + 1j * omega * damping
        for stiffness, damping in zip(specimen.stiffnesses, specimen.dampings, strict=True)
    )
    hung = -(omega**2) * m2 - omega**2 * m1 * inner / (inner - omega**2 * m1)
    pair = middle * hung / (middle + hung)
    cosine = 1.0 + (pair - omega**2 * m0) / (2.0 * outer)
    # The roots of q^2 - 2 cosine q + 1 multiply to 1: the larger is free of cancellation.
    root = np.sqrt(cosine**2 - 1.0 + 0j)
    larger = np.where(np.abs(cosine + root) >= np.abs(cosine - root), cosine + root, cosine - root)
    return np.asarray(1.0 / larger, dtype=np.complex128)


def band_frequencies_hz(specimen: Specimen, wave_number: ArrayLike) -> NDArray[np.float64]:
    """Frequencies at which a wave of phase ``wave_number`` from cell to cell travels without damping [Hz].

    Shape (n, 3), ascending; ``wave_number`` in radians per cell, shape (n,).
    """
    phase = np.atleast_1d(np.asarray(wave_number, dtype=np.float64))
    _, k1, k2 = specimen.stiffnesses
    root = np.sqrt(np.asarray(specimen.masses))
    # The neighbours hold a mass in step or against step: their springs act like one to the ground.
    held = 2.0 * specimen.stiffnesses[0] * (1.0 - np.cos(phase))
    stiffness = np.tile(np.array([[k2, 0.0, -k2], [0.0, k1, -k1], [-k2, -k1, k1 + k2]]), (len(phase), 1, 1))
    stiffness[:, 0, 0] += held
    squares = np.linalg.eigvalsh(stiffness / np.outer(root, root))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), dtype=np.float64)


class BandGap(NamedTuple):
    """Frequencies between which no wave travels [Hz]; the last gap has no upper end."""

    lower_hz: float
    upper_hz: float


def band_gaps(specimen: Specimen) -> tuple[BandGap, ...]:
    """Find the gaps of the endless chain without damping and contact.

    A frequency of a band rises with k0 (1 - cos mu), so that each band lies between mu = 0 and mu = pi.
    """
    starts, ends = band_frequencies_hz(specimen, [0.0, np.pi])
    above = [*starts[1:].tolist(), float("inf")]
    return tuple(
        BandGap(lower, upper) for lower, upper in zip(ends.tolist(), above, strict=True) if lower < upper
    )
