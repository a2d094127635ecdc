"""Read TOML files, and describe their errors in one sentence."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any


class UnreadableTomlError(ValueError):
    """Error: a file cannot be read or is not TOML; the message begins with the file's path."""


def toml_table(path: Path) -> dict[str, Any]:
    """Return the table of a TOML file.

    Raises UnreadableTomlError when the file is missing, is not text, or is not TOML.
    """
    try:
        # Use utf-8-sig, because some Windows editors write a byte-order mark at the start of a file.
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UnreadableTomlError(
            f"{path}: cannot be read ({error.strerror}); give the path of a TOML file"
        ) from error
    except UnicodeDecodeError as error:
        what = "is an HDF5 file" if error.object.startswith(b"\x89HDF") else "is not UTF-8 text"
        raise UnreadableTomlError(f"{path}: {what}; give a TOML file, saved as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise UnreadableTomlError(f"{path} is not valid TOML: {error}; correct that line") from error
    except RecursionError as error:
        raise UnreadableTomlError(f"{path}: lists or tables are nested too deeply; flatten them") from error


_ENUM_MEMBER = re.compile(r"<\w+\.\w+: ('[^']*')>")
"""Pattern of an enum's member as Python prints it, ``<Start.UP: 'up'>``."""
_LIST, _TABLE = "give a list, in square brackets", "give a table"
_TIME = "give a date, time and time zone, such as 2026-03-01T12:00:00Z"
_IN_WORDS_OF_TOML: Mapping[str, str] = {
    "list_type": _LIST,
    "tuple_type": _LIST,
    "dict_type": _TABLE,
    "model_type": _TABLE,
    "model_attributes_type": _TABLE,
    "too_short": "give {min_length} or more entries, not {actual_length}",
    "too_long": "give {max_length} entries or fewer, not {actual_length}",
    "string_type": "give text, in quotes",
    "string_too_short": "give text of {min_length} or more letters",
    "string_too_long": "give {max_length} letters or fewer",
    "float_parsing": "give a number",
    "int_parsing": "give a whole number",
    "int_from_float": "give a whole number",
    "datetime_type": _TIME,
    "datetime_parsing": _TIME,
    "datetime_from_date_parsing": _TIME,
    "timezone_aware": _TIME,
    "bool_type": "give true or false",
    "union_tag_not_found": "{discriminator} is missing: it selects the kind of this table",
    "union_tag_invalid": "{discriminator} = '{tag}' is not known; allowed are {expected_tags}",
}
"""Messages in TOML's terms, by pydantic's error type; these replace pydantic's messages in Python's terms."""


def fault_in_words(fault: Mapping[str, Any]) -> str:
    """Return the message for a wrong value in a TOML file, in the terms of TOML instead of Python.

    Parameters
    ----------
    fault
        One of the ``errors()`` of a pydantic ``ValidationError``.
    """
    plain = _IN_WORDS_OF_TOML.get(fault["type"])
    text = str(fault["msg"]) if plain is None else plain.format(**fault.get("ctx", {}))
    return _ENUM_MEMBER.sub(r"\1", text.removeprefix("Value error, "))
