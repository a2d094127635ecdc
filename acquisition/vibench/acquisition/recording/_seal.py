"""The seal of a recording: a checksum of its content, which shows any change.

A manifest lists two checksums for every group and dataset: one of its attributes, type and shape, and one of
its data. The SHA-256 of the manifest is the seal. With a key, the seal is also signed (HMAC, RFC 2104).
An unsigned seal shows only accidental changes: anyone can compute a new seal, but a signature needs the key.
``docs/recording-format.md`` shows how to check a seal without this package; reasons: decision 0031.
"""

import hashlib
import hmac
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import h5py
import numpy as np
from numpy.typing import NDArray

from vibench.sim.hdf5_files import system_error, walk

from ..errors import RecordingError, RecordingUnreachable
from ..instruments import Counts
from . import _layout as layout
from ._layout import READ_KINDS, read_attributes, read_text_dataset, write_attributes, write_text_dataset

if TYPE_CHECKING:
    from hashlib import _Hash as Hash

MANIFEST = "manifest_json"
SHA256, HMAC, KEY_ID = "sha256", "hmac_sha256", "key_id"
RESULT_MARKS = (f"seal_{SHA256}", f"seal_{HMAC}", f"seal_{KEY_ID}")
"""Attributes of a result's group that contain the seal, and are therefore not sealed themselves."""
LINKS = ("DIMENSION_LIST", "REFERENCE_LIST")
"""HDF5 attributes that link axes; these attributes contain addresses inside the file instead of data."""
PIECE_ITEMS = 4 * layout.CHUNK_SAMPLES
LARGEST_TABLE_BYTES = 500_000_000
"""Largest multidimensional array [bytes]; such arrays (results) are read in one piece."""
QUICK_BYTES = 65_536
"""Largest channel that a quick check reads [bytes]; texts and tables are always read."""
KEY_VARIABLE = "VIBENCH_SEAL_KEY"
"""Environment variable with the path of the key's file; used by all commands and programs."""
SHORTEST_KEY = 16
AS_SEALED = "unchanged since it was sealed"
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError)
"""Exceptions that h5py raises for damaged files."""


Manifest = dict[str, dict[str, str]]
ChannelStates = dict[str, list["Hash"]]
"""SHA-256 states, by path of the dataset: the state before each piece of data, and the final state."""


class SealDepth(StrEnum):
    """How much of a recording is checked against its seal."""

    QUICK = "quick"
    """All attributes, texts and tables; no samples, except of very short recordings."""
    WHOLE = "whole"


class SealState(StrEnum):
    """Result of comparing a recording with its seal."""

    INTACT = "intact"
    DAMAGED = "damaged"
    """The file was changed after it was sealed."""
    UNSEALED = "unsealed"
    """The file was written before seals existed; changes of scales, tables and plan cannot be detected."""
    SEAL_GONE = "seal_gone"
    """The file was written by a version that seals every recording, but its seal is missing."""
    UNFINISHED = "unfinished"
    """The file is still being recorded, or was cut off; it will be sealed when finished or recovered."""
    OTHER_KEY = "other_key"
    """The file is unchanged, but is not signed with the given key."""


@dataclass(frozen=True)
class SealCheck:
    """Result of a seal check, with an explanation."""

    state: SealState
    sentence: str
    seal: str
    """SHA-256 of the manifest; empty if the file has no seal."""


class SealKey:
    """Secret key of a user, for signing seals and checking signatures."""

    def __init__(self, secret: bytes) -> None:
        self._secret = secret

    @property
    def name(self) -> str:
        """Public name of the key, derived from the secret key."""
        return self.signature(b"name of this key")[:16]

    def signature(self, text: bytes) -> str:
        """Return the signature of a text: its HMAC-SHA-256 in hexadecimal digits."""
        return hmac.new(self._secret, text, hashlib.sha256).hexdigest()


def seal_key(path: Path | None = None) -> SealKey | None:
    """Return the key from a file, by default the file named by VIBENCH_SEAL_KEY; None if there is no file.

    Raises RecordingError when the file cannot be read, or when the key is too short.
    """
    named = os.environ.get(KEY_VARIABLE, "") if path is None else str(path)
    if not named:
        return None
    try:
        secret = Path(named).expanduser().read_bytes().strip()
    except OSError as error:
        raise RecordingError(
            f"The key {named} for seals cannot be read ({error.strerror}). Nothing was done; give the file"
            f" of the key (--key, or the variable {KEY_VARIABLE}), or give no key."
        ) from error
    if len(secret) < SHORTEST_KEY:
        raise RecordingError(
            f"The key {named} for seals has {len(secret)} bytes; at least {SHORTEST_KEY} are needed. Make a "
            "key with: head -c 32 /dev/urandom | base64"
        )
    return SealKey(secret)


def write_seal(file: h5py.File, known: Mapping[str, str], key: SealKey | None) -> None:
    """Seal a finished recording; ``known`` has the checksums of datasets that were computed while writing."""
    manifest = {
        path: {
            "attributes": _checksum_of_header(item),
            "data": known[path] if path in known else _data_sha256(item),
        }
        for path, item in _sealed_objects(file)
    }
    text = json.dumps(manifest, sort_keys=True)
    group = file.create_group(layout.SEAL)
    write_text_dataset(group, MANIFEST, text)
    write_attributes(group, _marks(text, key, (SHA256, HMAC, KEY_ID)))


def check_seal(
    file: h5py.File, depth: SealDepth, key: SealKey | None, states: ChannelStates | None = None
) -> SealCheck:
    """Check a finished recording against its seal; add the checksum states of its datasets to ``states``.

    Without a seal, the samples of each channel are checked against the checksum stored with the channel.
    """
    if layout.SEAL not in file:
        return _without_seal(file, depth, key)
    try:
        marks = read_attributes(file[layout.SEAL])
        text = read_text_dataset(file[layout.SEAL], MANIFEST)
        manifest: Manifest = json.loads(text)
        seal = _sha256(text.encode())
        if marks.get(SHA256) != seal:
            return SealCheck(SealState.DAMAGED, "the seal itself was changed", "")
        differing = list(_differing(file, manifest, depth, states))
    except DAMAGE as error:
        require_reachable(file, error)
        return SealCheck(SealState.DAMAGED, f"it cannot be read to check its seal ({error})", "")
    if differing:
        more = f" and {len(differing) - 3} more" if len(differing) > 3 else ""
        return SealCheck(SealState.DAMAGED, f"changed since sealing: {', '.join(differing[:3])}{more}", seal)
    as_sealed = AS_SEALED if depth is SealDepth.WHOLE else f"{AS_SEALED}, samples not checked"
    return _signature_check(text, [str(marks.get(each, "")) for each in (HMAC, KEY_ID)], key, seal, as_sealed)


def require_reachable(file: h5py.File | str, error: Exception) -> None:
    """Raise RecordingUnreachable if the operating system caused the error: the file may be intact."""
    if isinstance(error, RecordingUnreachable):
        raise error
    if reason := system_error(error):
        raise RecordingUnreachable(
            f"{getattr(file, 'filename', file)} could not be read ({reason}). The file may be intact: check "
            "the disk and its connection, copy the file to another disk, and try again."
        ) from error


def seal_of(file: h5py.File) -> str:
    """Return the seal stored in a recording, without checking it; empty if there is no seal."""
    return str(read_attributes(file[layout.SEAL]).get(SHA256, "")) if layout.SEAL in file else ""


def samples_id(file: h5py.File, roles: Sequence[str]) -> str:
    """Return the SHA-256 of the channels' stored checksums; empty if a checksum is missing."""
    stated = [str(read_attributes(file[role]).get("sha256", "")) for role in roles]
    return _sha256(" ".join(stated).encode()) if all(stated) else ""


class FileIdentity(Protocol):
    """Identifiers by which two files are recognised as the same recording."""

    @property
    def recording_id(self) -> str: ...
    @property
    def samples_id(self) -> str: ...


def first_copies(recordings: Sequence[FileIdentity]) -> list[int]:
    """Return, for each recording, the index of the first recording with the same samples or recording_id."""
    seen: dict[str, int] = {}
    firsts = []
    for place, each in enumerate(recordings):
        known = [key for key in (each.samples_id, each.recording_id) if key]
        first = next((seen[key] for key in known if key in seen), place)
        seen |= dict.fromkeys(known, first)
        firsts.append(first)
    return firsts


def copy_sentence(kept: FileIdentity, name: str, copy: FileIdentity) -> str:
    """Return the text that explains why ``copy`` counts as a duplicate of the recording ``name``."""
    if copy.samples_id and copy.samples_id == kept.samples_id:
        return f"has the same samples as {name}"
    return f"has the identity of the recording {name}: one of the two was altered, or is not finished"


def seal_result(group: h5py.Group, key: SealKey | None) -> None:
    """Seal a new result; the seal also covers the seal of the result's recording."""
    write_attributes(group, _marks(_result_text(group), key, RESULT_MARKS))


def check_result(group: h5py.Group, key: SealKey | None) -> SealCheck:
    """Check a result against its own seal."""
    try:
        marks = read_attributes(group)
        checksum, signature, key_id = (str(marks.get(each, "")) for each in RESULT_MARKS)
        if not checksum and is_of_a_sealing_version(group.file):
            return SealCheck(SealState.DAMAGED, "its seal is gone", "")
        if not checksum:
            return _missing_seal("it was saved before results were sealed", key)
        text = _result_text(group)
    except DAMAGE as error:
        require_reachable(group.file, error)
        return SealCheck(SealState.DAMAGED, f"it cannot be read to check its seal ({error})", "")
    if _sha256(text.encode()) != checksum:
        return SealCheck(SealState.DAMAGED, "changed since it was sealed", checksum)
    return _signature_check(text, [signature, key_id], key, checksum)


def _pieces(dataset: h5py.Dataset) -> Iterator[NDArray[Any]]:
    """Yield a dataset's data in pieces, in the order in which the data are hashed."""
    if dataset.ndim != 1:
        if dataset.nbytes > LARGEST_TABLE_BYTES:  # decompressed data of a small file may exceed this limit
            raise RecordingError(f"{dataset.name} ({dataset.nbytes:.2g} bytes) is larger than any result")
        yield np.asarray(dataset[()])
        return
    for begin in range(0, len(dataset), PIECE_ITEMS):
        yield np.ascontiguousarray(dataset[begin : begin + PIECE_ITEMS])


def _sealed_objects(file: h5py.File) -> Iterator[tuple[str, h5py.HLObject]]:
    """Iterate over all objects except the seal and the results, which are added later."""
    for path, item in walk(file):
        if path.split("/")[1] not in (layout.SEAL, layout.RESULTS):
            yield path, item


def _differing(
    file: h5py.File, manifest: Manifest, depth: SealDepth, states: ChannelStates | None
) -> Iterator[str]:
    found = dict(_sealed_objects(file))
    yield from (f"{path} is new" for path in found if path not in manifest)
    for path, checksums in manifest.items():
        item = found.get(path)
        if item is None:
            yield f"{path} is missing"
        elif checksums["attributes"] != _checksum_of_header(item):
            yield f"attributes, type or length of {path}"
        elif isinstance(item, h5py.Group) or (depth is SealDepth.QUICK and _is_long_signal(path, item)):
            continue
        elif checksums["data"] != _data_or_nothing(
            item, [] if states is None else states.setdefault(path, [])
        ):
            yield f"data of {path}"


def _is_long_signal(path: str, item: h5py.Dataset) -> bool:
    """Return whether a dataset is a long channel or its overview; all tables are in other groups."""
    return path.split("/")[1:-1] in ([], [layout.OVERVIEW]) and item.nbytes > QUICK_BYTES


def _checksum_of_header(item: h5py.HLObject) -> str:
    """Return the checksum of an HDF5 object's attributes, type and shape."""
    described: dict[str, Any] = {}
    attributes = item.attrs
    for name in attributes:
        if name in LINKS or name in RESULT_MARKS:
            continue
        if attributes.get_id(name).dtype.kind not in READ_KINDS:
            raise ValueError(f"the attribute {name!r} of {item.name} is neither number nor text")
        value = np.asarray(attributes[name])
        described[name] = [value.dtype.str, list(value.shape), value.tobytes().hex()]
    if isinstance(item, h5py.Dataset):
        described["/"] = [item.dtype.str, list(item.shape)]
    return _sha256(json.dumps(described, sort_keys=True).encode())


def _data_sha256(item: h5py.HLObject, states: list["Hash"] | None = None) -> str:
    if not isinstance(item, h5py.Dataset):
        return ""
    if item.dtype.kind not in READ_KINDS:
        raise ValueError(f"{item.name} holds neither numbers nor text")
    digest = hashlib.sha256()
    for piece in _pieces(item):
        if states is not None:
            states.append(digest.copy())
        digest.update(piece.tobytes() if piece.dtype.kind == "S" else piece.data)
    if states is not None:
        states.append(digest)
    return digest.hexdigest()


def _data_or_nothing(item: h5py.Dataset, states: list["Hash"]) -> str:
    """Return the checksum of a dataset's data, or "unreadable" if the data cannot be read."""
    try:
        return _data_sha256(item, states)
    except OSError as error:
        require_reachable(item.file, error)
        return "unreadable"


def _result_text(group: h5py.Group) -> str:
    objects = {
        path: {"attributes": _checksum_of_header(item), "data": _data_sha256(item)}
        for path, item in walk(group)
    }
    return json.dumps({"recording": seal_of(group.file), "objects": objects}, sort_keys=True)


def is_of_a_sealing_version(file: h5py.File) -> bool:
    """Whether a finished file was written by a version that seals every recording."""
    return not {layout.SEAL, layout.OVERVIEW, layout.VIEW}.isdisjoint(file)


def _without_seal(file: h5py.File, depth: SealDepth, key: SealKey | None) -> SealCheck:
    """Check the channels' checksums, which do not cover scales, tables and the plan."""
    roles = str(read_attributes(file).get("roles", "")).split() if depth is SealDepth.WHOLE else ()
    try:
        other = [role for role in roles if _data_sha256(file[role]) != read_attributes(file[role])["sha256"]]
    except DAMAGE as error:
        require_reachable(file, error)
        return SealCheck(SealState.DAMAGED, f"it has no seal, and cannot be read ({error})", "")
    if other:
        sentence = f"it has no seal, and the samples of {', '.join(other)} do not match their checksum"
        return SealCheck(SealState.DAMAGED, sentence, "")
    if key is None and is_of_a_sealing_version(file):
        version = str(read_attributes(file).get("software_version", ""))
        sentence = (
            f"its seal is gone: vibench {version} seals every recording, so scales, tables or plan may have "
            "been changed; restore the recording from a copy"
        )
        return SealCheck(SealState.SEAL_GONE, sentence, "")
    return _missing_seal("it was made before recordings were sealed", key)


def _marks(text: str, key: SealKey | None, names: tuple[str, str, str]) -> dict[str, str | int | float]:
    raw = text.encode()
    values = (_sha256(raw),) if key is None else (_sha256(raw), key.signature(raw), key.name)
    return dict(zip(names, values, strict=False))


def _missing_seal(excuse: str, key: SealKey | None) -> SealCheck:
    """Report a missing seal, which is an error if a key is given: a forger could have removed the seal."""
    if key is None:
        return SealCheck(SealState.UNSEALED, f"it has no seal: {excuse}", "")
    return SealCheck(SealState.OTHER_KEY, f"it has no seal to check with the key ({key.name})", "")


def _signature_check(
    text: str, signed: list[str], key: SealKey | None, seal: str, as_sealed: str = AS_SEALED
) -> SealCheck:
    signature, key_id = signed
    if key is None:
        also = f"; signed with the key {key_id}, which was not given" if key_id else ""
        return SealCheck(SealState.INTACT, f"{as_sealed}{also}", seal)
    if not signature or key_id != key.name:
        by = f"with the key {key_id}" if key_id else "without a key"
        sentence = f"{as_sealed}, but sealed {by}, not with the given key ({key.name})"
        return SealCheck(SealState.OTHER_KEY, sentence, seal)
    if not hmac.compare_digest(signature.encode(), key.signature(text.encode()).encode()):
        return SealCheck(SealState.DAMAGED, "its signature does not match the key: it was forged", seal)
    return SealCheck(SealState.INTACT, f"{as_sealed}, and signed with the key {key.name}", seal)


def _sha256(raw: bytes) -> str:
    return hashlib.sha256(raw).hexdigest()


# Campaign journals list the seals of recordings, and so show when another recording has taken a name. Every
# check of a seal therefore also reads the journals.

JOURNAL_SUFFIX = ".campaign.sqlite"

_NOTED = """
WITH last AS (SELECT file, name, seal, MAX(number) FROM attempts GROUP BY file)
SELECT file, points.name, points.seal, COALESCE(last.seal, '') FROM points LEFT JOIN last USING (file)
UNION ALL SELECT file, name, seal, seal FROM last WHERE file NOT IN (SELECT file FROM points)
"""


@dataclass(frozen=True)
class NotedSeal:
    """Seals of one file in the two tables of a journal."""

    point: str
    seal: str
    """Seal in the table of points; for the file of an earlier attempt, the seal of that attempt."""
    attempt_seal: str
    """Seal in the table of attempts; empty if there was no attempt, or if seals did not exist yet."""


def noted_seals(folder: Path) -> dict[str, list[NotedSeal]]:
    """Return the seals in the journals of a folder, by file name.

    A journal that cannot be read is skipped here; `vibench verify` reports it.
    """
    noted: dict[str, list[NotedSeal]] = {}
    for journal in sorted(folder.glob(f"*{JOURNAL_SUFFIX}")):
        with suppress(sqlite3.Error), closing(open_read_only(journal)) as connection:
            for file, *seals in connection.execute(_NOTED):
                noted.setdefault(file, []).append(NotedSeal(*seals))
    return noted


def journal_objection(path: Path, seal: str) -> str:
    """Return why a journal in the folder contradicts the recording's seal; empty if no journal does.

    Both tables of a journal must contain the same seal. If they differ, neither confirms the recording.
    """
    noted = noted_seals(path.parent).get(path.name, [])
    stated = {each for one in noted for each in (one.seal, one.attempt_seal) if each}
    if stated and seal not in stated:
        point = noted[0].point
        return f"its seal differs from the seal of {point} in the campaign's journal: it is another recording"
    for each in noted:
        if each.attempt_seal not in ("", each.seal):
            return f"the campaign's journal has two seals for {each.point}: the journal was changed"
    return ""


def open_database(uri: str) -> sqlite3.Connection:
    """Open the database at a SQLite ``uri``; transactions must be started and ended explicitly."""
    connection = sqlite3.connect(uri, uri=True, isolation_level=None)
    connection.row_factory = sqlite3.Row
    return connection


@contextmanager
def close_on_error(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    """Close a new ``connection`` if its first use fails, because Windows cannot move or delete an open file.

    Raises sqlite3.Error, or any other error of the first use, after closing.
    """
    try:
        yield connection
    except BaseException:
        connection.close()
        raise


def open_read_only(path: Path) -> sqlite3.Connection:
    """Open a database read-only, even in a read-only folder."""
    address = path.resolve().as_uri()
    try:
        # A connection in mode rw also cleans up the database files if it is the last to close.
        with close_on_error(open_database(f"{address}?mode=rw")) as connection:
            connection.execute("PRAGMA query_only = ON")
            connection.execute("SELECT 1 FROM sqlite_master").fetchone()
            return connection
    except sqlite3.OperationalError:
        return open_database(f"{address}?mode=ro")


# The check of a seal reads all samples. An analysis reads samples again, which must still be the same. For
# each seal, the check therefore keeps the state of each channel's checksum before every piece. When a piece
# is read again, it is hashed and compared with these states.

_KNOWN: dict[str, ChannelStates] = {}
"""Checksum states, by seal; about 20 kB for a recording of one minute."""


def remember(seal: str, states: ChannelStates) -> None:
    """Keep the checksum states of a seal, for comparison with later reads of files that have this seal."""
    _KNOWN[seal] = states


def forget_checks() -> None:
    """Discard the results of all checks, so that files are checked again when they are next read."""
    _KNOWN.clear()


def was_checked(seal: str) -> bool:
    """Whether this process has checked a whole file with this seal and found no change."""
    return seal in _KNOWN


class CheckedCounts:
    """Reader of the channels of one open file; keeps the last piece of each channel in memory."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, Counts]] = {}

    def read(self, seal: str, dataset: h5py.Dataset, begin: int, end: int) -> Counts:
        """Return the counts of a range; raises ValueError if the counts were changed after the check."""
        known = _KNOWN.get(seal)
        if known is None:
            return np.asarray(dataset[begin:end], dtype=np.int32)
        counts = np.empty(end - begin, dtype=np.int32)
        for number in range(begin // PIECE_ITEMS, -(-end // PIECE_ITEMS)):
            first = number * PIECE_ITEMS
            piece = self._piece(known[dataset.name], dataset, number)
            low, high = max(begin, first), min(end, first + len(piece))
            counts[low - begin : high - begin] = piece[low - first : high - first]
        return counts

    def _piece(self, states: "Sequence[Hash]", dataset: h5py.Dataset, number: int) -> Counts:
        held, counts = self._last.get(dataset.name, (-1, None))
        if held == number and counts is not None:
            return counts
        first = number * PIECE_ITEMS
        piece = np.ascontiguousarray(dataset[first : first + PIECE_ITEMS], dtype=np.int32)
        digest = states[number].copy()
        digest.update(piece.data)
        if digest.digest() != states[number + 1].digest():
            raise ValueError("they were changed after the seal had been checked")
        self._last[dataset.name] = (number, piece)
        return piece
