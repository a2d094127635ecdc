"""Files that can be imported: their channels, and the samples of a channel in any range."""

import re
import struct
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from vibench.acquisition import shorten
from vibench.sim.hdf5_files import system_error

from ..errors import InvalidRequest, UnusableData
from ..signals import Reals
from ._csv import open_csv
from ._hdf5_source import open_hdf5_source
from ._mapping import unit_in_name
from ._mat import open_mat
from ._source_channel import NAME_SHOWN, Read, Source, SourceChannel
from ._tdms_source import open_tdms
from ._times import is_time_of, time_axis
from ._uff import open_uff
from ._wav import open_wav

_READERS: dict[str, Callable[[Path], AbstractContextManager[Source]]] = {
    ".uff": open_uff,
    ".unv": open_uff,
    ".ufb": open_uff,
    ".bunv": open_uff,
    ".h5": open_hdf5_source,
    ".hdf5": open_hdf5_source,
    ".mat": open_mat,
    ".nc": open_hdf5_source,
    ".tdms": open_tdms,
    ".wav": open_wav,
    ".csv": open_csv,
    ".txt": open_csv,
}
DAMAGE = (
    OSError,
    EOFError,
    RuntimeError,
    KeyError,
    IndexError,
    ValueError,
    TypeError,
    ArithmeticError,
    MemoryError,
    UnboundLocalError,
    struct.error,
)
"""Errors that h5py, npTDMS and scipy raise for damaged files."""


CHANNELS_SHOWN = 20
"""Maximum number of channels listed in an error message."""
MOST_CHANNELS = 4096
"""Maximum number of channels; a larger number means a transposed table or a damaged file."""


@contextmanager
def open_source(path: Path) -> Iterator[Source]:
    """Open a file with the reader for its suffix. Nothing in it is ever executed: no pickles, no macros.

    Raises InvalidRequest when the file does not exist or has no reader for its suffix; UnusableData when it
    is damaged or contains no channel.
    """
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist, or is not a file"
        raise InvalidRequest(f"{path} {what}; give the path of a file to import")
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InvalidRequest(
            f"{path.name} cannot be imported: {path.suffix or 'a name without suffix'} is none of "
            f"{', '.join(_READERS)}; export it in one of these formats, and import that file"
        )
    with ExitStack() as stack:
        with _readable(path):
            source = stack.enter_context(reader(path))
            if not source.channels:
                raise UnusableData(
                    f"{path.name} contains no real samples over time; spectra and pictures cannot be imported"
                )
            if len(source.channels) > MOST_CHANNELS:
                raise UnusableData(
                    f"{path.name} has {len(source.channels)} rows or columns of numbers, but a measurement "
                    f"has at most {MOST_CHANNELS} channels; export fewer channels"
                )
        readers = {each: _checked(read, each, path) for each, read in source.readers.items()}
        timed = _channels_with_times(replace(source, readers=readers))
        yield Source(dict(zip(timed, readers.values(), strict=True)))


def _channels_with_times(source: Source) -> Iterator[SourceChannel]:
    """Yield the channels, each with the times that the file contains for this channel."""
    read = {each: time_axis(each, source.blocks(each)) for each in source.channels}
    axes = {each: axis for each, axis in read.items() if axis is not None}
    for time, axis in axes.items():  # a label may name a channel: t_v has the times of v
        if any(is_time_of(time.label, each.label) for each in source.channels):
            axes[time] = replace(axis, is_named=True)
    for number, each in enumerate(source.channels):
        ranks = {time: _rank(time, each, is_named=axes[time].is_named) for time in axes}
        best = max(ranks.values(), default=())
        near = [time for time, rank in ranks.items() if rank == best and any(rank)]
        before = [time for time in near if time in source.channels[: number + 1]]
        chosen = before[-1:] or near[:1]
        if len({axes[time].moments for time in near if axes[time].unit is not None}) > 1:
            # Which channels belong to a time column is clear only if every such column precedes its channels.
            order = [one in near for one in source.channels if one in near or _group(one) == _group(each)]
            is_clear = order[0] and not any(one and two for one, two in pairwise(order))
            if not (source.are_in_order and is_clear):
                named = ", ".join(shorten(time.name, NAME_SHOWN) for time in near[:CHANNELS_SHOWN])
                axes[chosen[0]] = replace(axes[chosen[0]], trouble=f"has different times in {named}")
        channel = replace(each, unit=each.unit or unit_in_name(each.label or each.name))
        yield axes[chosen[0]].of(channel) if chosen else channel


def _rank(time: SourceChannel, channel: SourceChannel, *, is_named: bool) -> tuple[bool, bool, int]:
    """Return a key that ranks time columns for a channel; all zero if the times do not fit it."""
    if time.samples != channel.samples:
        return False, False, 0
    is_above = _group(channel).startswith(_group(time))
    return is_above, is_named, len(_group(time)) + 1 if is_above else 0


def _group(channel: SourceChannel) -> str:
    """Return the part of a channel's name before the last separator."""
    return re.sub(r"[^/.]*$", "", channel.name)


def _checked(read: Read, channel: SourceChannel, path: Path) -> Read:
    """Return a function that reads a channel, with every failure as a vibench error and infinity as NaN."""

    def read_checked(start: int, stop: int) -> Reals:
        # Ignore the warning on a signalling NaN: it is a lost sample like any other NaN.
        with _readable(path), np.errstate(invalid="ignore"):
            values = read(start, stop)
        if values.shape != (stop - start,):
            raise UnusableData(
                f"{path.name} contains only {values.size} of the {stop - start} numbers of "
                f"{channel.name} from sample {start} on; copy or export it again"
            )
        return np.where(np.isfinite(values), values, np.nan)

    return read_checked


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except (InvalidRequest, UnusableData):
        raise
    except DAMAGE as error:
        if reason := system_error(error):
            raise UnusableData(f"{path.name} could not be read ({reason}); check the disk") from error
        raise UnusableData(
            f"{path.name} is damaged, or has a wrong suffix ({shorten(str(error))}); copy or export it again"
        ) from error


def find_channel(source: Source, wanted: str, path: Path) -> SourceChannel:
    """Return the channel with the name ``wanted``, or the only channel with this label.

    Raises InvalidRequest when no channel or several channels match; the message lists the channels.
    """
    found = [each for each in source.channels if each.name == wanted]
    found = found or [each for each in source.channels if each.label == wanted]
    if len(found) == 1:
        return found[0]
    many = "several channels" if found else "no channel"
    named = [each.title for each in source.channels[:CHANNELS_SHOWN]]
    rest = len(source.channels) - len(named)
    held = ", ".join(named) + (f" and {rest} more" if rest else "")
    raise InvalidRequest(f"{path.name} has {many} {shorten(wanted, NAME_SHOWN)!r}; it has {held}")
