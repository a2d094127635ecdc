"""Arrays on the wire: one packed field instead of a list of numbers (protobuf "Packed repeated fields")."""

import numpy as np
from numpy.typing import NDArray

_STATUS_TAG = b"\x08"
"""Field 1, varint."""
_ARRAY_TAG = b"\x12"
"""Field 2, length-delimited."""
_COUNT_TAG = b"\x18"
"""Field 3, varint."""
_MORE = 0x80
_SEVEN_BITS = 0x7F
_INT64_WRAP = 1 << 64


def varint(number: int) -> bytes:
    """Write a number in base-128 digits, least first; a negative one wraps as 64 bits do."""
    if number < 0:
        number += _INT64_WRAP
    digits = bytearray()
    while number > _SEVEN_BITS:
        digits.append(number & _SEVEN_BITS | _MORE)
        number >>= 7
    digits.append(number)
    return bytes(digits)


def packed_response(status: int, values: NDArray[np.float64], samples: int) -> bytes:
    """Write a ReadAnalogF64Response, ready to send: status, array, samples per channel."""
    raw = np.ascontiguousarray(values, dtype="<f8").tobytes()
    array = _ARRAY_TAG + varint(len(raw)) + raw
    return b"".join((_STATUS_TAG, varint(status), array, _COUNT_TAG, varint(samples)))
