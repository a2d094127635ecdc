"""Write NeXus files: an NXentry with one NXdata per channel, which silx plots with labels.

As in the NeXus standard (NXdata, version 2024.02), each group names its ``signal`` and ``axes``. Values are
in physical units, because readers do not apply scales. Errors are half a converter step.
"""

from pathlib import Path

import h5py

from vibench.acquisition.recording import ChannelHeader
from vibench.sim.hdf5_files.writing import open_hdf5_to_write

from ._excerpt import BLOCK_SAMPLES, Excerpt, TransferObserver, ignore_progress

ENTRY = "entry"
SIGNAL, TIME = "values", "time"


def write_nexus(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write channels one after the other in blocks; lost samples are NaN."""
    with open_hdf5_to_write(path, "x") as file:
        file.attrs.update({"NX_class": "NXroot", "default": ENTRY})
        entry = _group(file, ENTRY, "NXentry")
        entry["title"] = f"{excerpt.name}: {excerpt.recording.plan.get('name', '')}".removesuffix(": ")
        entry["start_time"] = excerpt.recording.started_utc
        entry["program_name"] = "vibench"
        # Default plot: the response of m0 if it was recorded.
        entry.attrs["default"] = "m0_velocity" if "m0_velocity" in excerpt.roles else excerpt.roles[-1]
        for channel in excerpt.channels:
            _write_channel(entry, excerpt, channel, observer)


def _group(parent: h5py.Group, name: str, nexus_class: str) -> h5py.Group:
    group = parent.create_group(name)
    group.attrs["NX_class"] = nexus_class
    return group


def _write_channel(
    entry: h5py.Group, excerpt: Excerpt, channel: ChannelHeader, observer: TransferObserver
) -> None:
    data = _group(entry, channel.role, "NXdata")
    data.attrs.update({"signal": SIGNAL, "axes": [TIME], f"{TIME}_indices": 0})
    # silx has no label for the vertical axis, so the title contains the unit too.
    data["title"] = f"{excerpt.name}: {channel.long_name or channel.role} [{channel.unit}]"
    chunks = (min(BLOCK_SAMPLES, excerpt.samples),)
    stored = {"shape": (excerpt.samples,), "dtype": "f8", "chunks": chunks, "compression": "gzip"}
    values, time = data.create_dataset(SIGNAL, **stored), data.create_dataset(TIME, **stored)
    label = f"{channel.long_name or channel.role} [{channel.unit}]"
    values.attrs.update({"units": channel.unit, "long_name": label})
    time.attrs.update({"units": "s", "long_name": "time [s]"})
    errors = data.create_dataset(f"{SIGNAL}_errors", **stored, fillvalue=0.5 * abs(channel.scale_factor))
    errors.attrs["units"] = channel.unit
    done = 0
    for block in excerpt.channel_blocks(channel.role):
        place = slice(done, done + block.size)
        values[place] = block
        time[place] = excerpt.recording.time_s(excerpt.start + done, excerpt.start + done + block.size)
        done += block.size
        observer(block.size)
