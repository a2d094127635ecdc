"""Seals listed in the journals of campaigns: they reveal another recording under the same name.

The check of a seal asks for them, so that every command identifies recordings by this one rule.
"""

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path

JOURNAL_SUFFIX = ".campaign.sqlite"

_NOTED = """
SELECT seal, name FROM points WHERE file = :file AND seal != ''
UNION SELECT seal, name FROM attempts WHERE file = :file AND seal != ''
"""


def noted_seals(path: Path) -> Mapping[str, str]:
    """Return the points that a recording was made for, by the seal that a journal in its folder noted.

    Empty where no journal knows the file. A journal that cannot be read notes nothing: `vibench
    verify` reports it.
    """
    noted: dict[str, str] = {}
    file = path.name.encode(errors="replace").decode()  # a name that is no text stands in no journal
    for journal in sorted(path.parent.glob(f"*{JOURNAL_SUFFIX}")):
        with suppress(sqlite3.Error), closing(opened_to_look(journal)) as connection:
            noted |= connection.execute(_NOTED, {"file": file}).fetchall()
    return noted


def opened(uri: str) -> sqlite3.Connection:
    """Open a database; its transactions are begun and ended by hand.

    Parameters
    ----------
    uri
        Address of the file with its mode, as SQLite spells it.

    """
    connection = sqlite3.connect(uri, uri=True, isolation_level=None)
    connection.row_factory = sqlite3.Row
    return connection


@contextmanager
def closed_on_error(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    """Close a new connection if its first use fails: Windows lets nobody move or delete an open file.

    Parameters
    ----------
    connection
        Just opened.

    Raises
    ------
    sqlite3.Error
        Whatever the first use raised, after closing.

    """
    try:
        yield connection
    except BaseException:
        connection.close()
        raise


def opened_to_look(path: Path) -> sqlite3.Connection:
    """Open a database to read it, also where nothing may be written."""
    address = path.resolve().as_uri()
    try:
        # One that may write tidies up behind itself when it was the last to look.
        with closed_on_error(opened(f"{address}?mode=rw")) as connection:
            connection.execute("PRAGMA query_only = ON")
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
            return connection
    except sqlite3.OperationalError:
        return opened(f"{address}?mode=ro")
