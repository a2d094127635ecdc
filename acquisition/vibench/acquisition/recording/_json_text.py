"""Values as JSON text that any language can read back: no NaN, no infinities."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import RecordingError


def json_text(what: str, values: Mapping[str, Any]) -> str:
    """Write a mapping as JSON; numbers and arrays of numpy become plain ones.

    Raises
    ------
    RecordingError
        When a value is nothing that JSON can hold; ``what`` names the mapping in the sentence.

    """
    try:
        return json.dumps(dict(values), allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"{what} cannot be kept as JSON: {error}. Give text, finite numbers, truth values, None,"
            " or lists and mappings of them."
        ) from error


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} was given")
