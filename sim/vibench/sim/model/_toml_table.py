"""A TOML file as a table, or one sentence that says why it is none."""

import tomllib
from pathlib import Path
from typing import Any


class UnreadableTomlError(ValueError):
    """A file that cannot be read, or is no TOML; the sentence begins with its path."""


def toml_table(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises
    ------
    UnreadableTomlError
        In one sentence, when the file is missing, is no text, or is not TOML.

    """
    try:
        # Editors on Windows begin a file with a byte-order mark.
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UnreadableTomlError(
            f"{path}: cannot be read ({error.strerror}); give the path of a TOML file"
        ) from error
    except UnicodeDecodeError as error:
        raise UnreadableTomlError(f"{path}: is not UTF-8 text; save it as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise UnreadableTomlError(f"{path}: is not valid TOML: {error}; correct that line") from error
    except RecursionError as error:
        raise UnreadableTomlError(
            f"{path}: holds lists or tables within each other, too many to be read; write them side by side"
        ) from error
