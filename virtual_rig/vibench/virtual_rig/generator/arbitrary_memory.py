"""The waveform memories of the generator: one edit memory, 256 user memories, 14-bit codes."""

import numpy as np
from numpy.typing import NDArray

from .scpi_status import ErrorCode, ScpiError

Codes = NDArray[np.uint16]

FEWEST_POINTS = 2
MOST_POINTS = 8192
TOP_CODE = 16383
"""14 bits (Tektronix AFG1000 IVI driver tkafg1k; confirmed by read-back in public drivers)."""
USER_MEMORIES = 256
EDIT_MEMORY = "EMEM"
_MIDDLE_CODE = 8191
_POWER_ON_POINTS = 1000
"""Length of the edit memory after power-on (assumed, as in the AFG3000 series)."""


class ArbitraryMemory:
    """Edit memory and user memories; every stored waveform is immutable."""

    def __init__(self, most_points: int = MOST_POINTS, top_code: int = TOP_CODE) -> None:
        self.top_code = top_code
        self._most_points = most_points
        self._waveforms: dict[str, Codes] = {EDIT_MEMORY: _blank(_POWER_ON_POINTS)}

    def codes(self, name: str) -> Codes:
        """Return the codes of a memory; an empty user memory is refused with -224."""
        try:
            return self._waveforms[name]
        except KeyError:
            raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE) from None

    def define(self, points: int) -> None:
        """Make the edit memory ``points`` long and flat."""
        self._store(EDIT_MEMORY, _blank(self._checked_length(points)))

    def load(self, name: str, data: bytes) -> None:
        """Fill a memory from big-endian 16-bit codes."""
        if len(data) % 2:
            raise ScpiError(ErrorCode.INVALID_BLOCK_DATA)
        self._checked_length(len(data) // 2)
        codes = np.frombuffer(data, dtype=">u2").astype(np.uint16)
        if codes.max() > self.top_code:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        self._store(name, codes)

    def copy(self, source: str, target: str) -> None:
        """Copy one memory onto another."""
        self._waveforms[target] = self.codes(source)

    @property
    def catalogue(self) -> tuple[str, ...]:
        """Names of all memories that hold a waveform, the edit memory first."""
        users = [name for name in self._waveforms if name != EDIT_MEMORY]
        return (EDIT_MEMORY, *sorted(users, key=lambda name: int(name.removeprefix("USER"))))

    def hold(self, codes: Codes) -> None:
        """Let the edit memory hold codes of any generator."""
        self._checked_length(len(codes))
        self._store(EDIT_MEMORY, codes)

    def _checked_length(self, points: int) -> int:
        if not FEWEST_POINTS <= points <= self._most_points:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        return points

    def _store(self, name: str, codes: Codes) -> None:
        codes.flags.writeable = False
        self._waveforms[name] = codes


def memory_name(word: str) -> str | None:
    """Return the canonical name of the memory that a word means, or None if it means none."""
    upper = word.upper()
    if upper in ("EMEM", "EMEMORY"):
        return EDIT_MEMORY
    number = upper.removeprefix("USER")
    if upper == "USER":
        return "USER0"
    if number != upper and number.isdigit() and int(number) < USER_MEMORIES:
        return f"USER{int(number)}"
    return None


def big_endian(codes: Codes) -> bytes:
    """Codes as they travel on the wire."""
    return codes.astype(">u2").tobytes()


def _blank(points: int) -> Codes:
    codes = np.full(points, _MIDDLE_CODE, dtype=np.uint16)
    codes.flags.writeable = False
    return codes
