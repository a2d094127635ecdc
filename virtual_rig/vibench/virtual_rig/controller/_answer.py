"""One sample of a controller, compiled: phase, Fourier series, law, and the coefficients that come back."""

from enum import IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibench.sim.kernels import kernel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class Now(IntEnum):
    """Places of a controller's numbers."""

    THETA = 0
    """Of the sample [rad], within a turn."""
    OMEGA = auto()
    """Phase per sample [rad]."""
    OMEGA_FROM = auto()
    OMEGA_TO = auto()
    GLIDE = auto()
    """From 0 to 1."""
    GLIDE_STEP = auto()
    FADE = auto()
    """Of everything that is played, 1 but for its end."""
    FADE_STEP = auto()
    LIMIT = auto()
    AT_LIMIT = auto()
    """Samples in a row with the output at its limit."""
    TURNS = auto()
    """Periods since the block began."""
    BLOCK = auto()
    """Periods of a block."""
    WEIGHT = auto()
    STEADY = auto()
    DONE = auto()
    """1 when a block has been completed, 2 when nothing was changed in it."""
    ON = auto()
    """0 while it is silent."""
    UNHEARD = auto()
    """Samples since its host said anything."""
    MOST_UNHEARD = auto()
    MOST_AT_LIMIT = auto()


_THETA, _OMEGA, _OMEGA_FROM, _OMEGA_TO = map(int, (Now.THETA, Now.OMEGA, Now.OMEGA_FROM, Now.OMEGA_TO))
_GLIDE, _GLIDE_STEP, _FADE, _FADE_STEP = map(int, (Now.GLIDE, Now.GLIDE_STEP, Now.FADE, Now.FADE_STEP))
_LIMIT, _AT_LIMIT, _TURNS = map(int, (Now.LIMIT, Now.AT_LIMIT, Now.TURNS))
_BLOCK, _WEIGHT, _STEADY, _DONE = map(int, (Now.BLOCK, Now.WEIGHT, Now.STEADY, Now.DONE))
_ON, _UNHEARD = map(int, (Now.ON, Now.UNHEARD))
_MOST_UNHEARD, _MOST_AT_LIMIT = map(int, (Now.MOST_UNHEARD, Now.MOST_AT_LIMIT))


class LoopParts(NamedTuple):
    """What a sample is answered with, and what it changes."""

    now: FloatArray
    """By `Now`."""
    reference: ComplexArray
    """Coefficients before the glide and after it, shape (2, harmonics) [V]."""
    law: FloatArray
    memory: FloatArray
    sums: ComplexArray
    """Of the block that lasts, shape (3, 1 + harmonics)."""
    done: ComplexArray
    """Coefficients of the last block."""


@kernel
def answer(base_v: float, m0_v: float, parts: LoopParts) -> float:
    """Give the volts that answer the means of both sensors over the last sample [V]; none while silent."""
    now, reference, law, memory, sums, done = parts
    if now[_ON] == 0.0:
        return 0.0
    now[_UNHEARD] += 1.0
    if now[_GLIDE] < 1.0:
        now[_GLIDE] = min(now[_GLIDE] + now[_GLIDE_STEP], 1.0)
        now[_STEADY] = 0.0
    share = 0.5 - 0.5 * np.cos(np.pi * now[_GLIDE])
    now[_OMEGA] = now[_OMEGA_FROM] + share * (now[_OMEGA_TO] - now[_OMEGA_FROM])
    turn = complex(np.cos(now[_THETA]), np.sin(now[_THETA]))
    volts, turned = 0.0, turn
    for k in range(reference.shape[1]):
        wanted = reference[0, k] + share * (reference[1, k] - reference[0, k])
        volts += wanted.real * turned.real - wanted.imag * turned.imag
        turned *= turn
    volts += _law(base_v, m0_v, law, memory)
    if now[_FADE_STEP] > 0.0:
        now[_FADE] = max(now[_FADE] - now[_FADE_STEP], 0.0)
        now[_STEADY] = 0.0
    volts *= 0.5 - 0.5 * np.cos(np.pi * now[_FADE])
    now[_AT_LIMIT] = now[_AT_LIMIT] + 1.0 if abs(volts) > now[_LIMIT] else 0.0
    volts = min(max(volts, -now[_LIMIT]), now[_LIMIT])
    _look(volts, base_v, m0_v, now, turn, sums, done)
    now[_THETA] = (now[_THETA] + now[_OMEGA]) % (2.0 * np.pi)
    return float(volts)


@kernel
def wants_attention(now: FloatArray) -> bool:
    """Whether a block is to be kept, or the controller is to end or has ended, before the next sample."""
    return bool(
        now[_DONE] > 0.0
        or now[_UNHEARD] > now[_MOST_UNHEARD]
        or now[_AT_LIMIT] > now[_MOST_AT_LIMIT]
        or (now[_ON] > 0.0 and now[_FADE] <= 0.0)
    )


@kernel
def _law(base_v: float, m0_v: float, law: FloatArray, memory: FloatArray) -> float:
    """Give the law's answer, and remember; the last number of the memory is room for the new one."""
    size = law.shape[0] - 1
    volts = 0.0
    for row in range(size, -1, -1):
        total = law[row, size] * base_v + law[row, size + 1] * m0_v
        for column in range(size):
            total += law[row, column] * memory[column]
        if row == size:
            volts = total
        else:
            memory[size + row] = total
    memory[:size] = memory[size : 2 * size]
    return float(volts)


@kernel
def _look(
    volts: float,
    base_v: float,
    m0_v: float,
    now: FloatArray,
    turn: complex,
    sums: ComplexArray,
    done: ComplexArray,
) -> None:
    """Add a sample to the coefficients; a block's ends weigh nothing, so that it need not end on a sample."""
    weight = 1.0 - np.cos(2.0 * np.pi * now[_TURNS] / now[_BLOCK])
    turned, back = complex(weight, 0.0), turn.conjugate()
    for k in range(sums.shape[1]):
        sums[0, k] += volts * turned
        sums[1, k] += base_v * turned
        sums[2, k] += m0_v * turned
        turned *= back
    now[_WEIGHT] += weight
    now[_TURNS] += now[_OMEGA] / (2.0 * np.pi)
    if now[_TURNS] >= now[_BLOCK]:
        for row in range(sums.shape[0]):
            for k in range(sums.shape[1]):
                done[row, k] = sums[row, k] * ((1.0 if k == 0 else 2.0) / now[_WEIGHT])
                sums[row, k] = 0.0
        now[_DONE] = 1.0 + now[_STEADY]
        now[_TURNS] = 0.0
        now[_WEIGHT] = 0.0
        now[_STEADY] = 1.0
