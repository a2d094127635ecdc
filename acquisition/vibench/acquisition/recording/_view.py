"""A recording as programs of others open it: a labelled curve a channel, as NeXus describes plots.

Such programs apply no scale to counts, so that the extremes of every bin stand here once more, in physical
units, one after the other in time: drawn as a line they are the envelope of the recording.
"""

import h5py
import numpy as np

from . import _layout as layout
from ._attributes import read_attributes, write_attributes, write_text_dataset
from ._overview import BIN_SAMPLES, CountOverview

SIGNAL = "values"
FIRST_CHOICE = "m0_velocity"
"""What is plotted where nobody chooses a channel; without it, the last one."""
VIEW_BYTES, VIEW_TIME_BYTES = 8, 16
"""Of a channel's bin, and of the time axis that all share, when nothing can be compressed."""


def write_view(file: h5py.File, role: str, overview: CountOverview, title: str) -> None:
    """Add a channel's labelled curve; the file's own attribute ``default`` leads to it."""
    if overview.low.size == 0:
        return
    view = file.require_group(layout.VIEW)
    if "default" not in view.attrs or role == FIRST_CHOICE:
        write_attributes(file, {"NX_class": "NXroot", "default": layout.VIEW})
        write_attributes(view, {"NX_class": "NXentry", "default": role})
    channel = read_attributes(file[role])
    name = str(channel["long_name"]) or role
    data = view.create_group(role)
    write_attributes(data, {"NX_class": "NXdata", "signal": SIGNAL, "axes": layout.TIME, "time_indices": 0})
    # silx names no vertical axis: the unit stands in the title as well.
    write_text_dataset(data, "title", f"{title}: {role.replace('_', ' ')} [{channel['units']}]")
    write_attributes(
        data.create_dataset(SIGNAL, data=_physical(overview, channel), compression="gzip", shuffle=True),
        {
            "units": channel["units"],
            "long_name": f"{name} [{channel['units']}]",
            "comment": f"smallest and largest of every {BIN_SAMPLES} samples, by turns",
        },
    )
    data[layout.TIME] = _time_axis(file, view, overview.low.size)


def _physical(overview: CountOverview, channel: dict[str, str | int | float]) -> np.ndarray:
    """Low and high of each bin by turns; NaN where all of its samples are lost."""
    counts = np.column_stack((overview.low, overview.high)).ravel()
    values = counts * float(channel["scale_factor"]) + float(channel["add_offset"])
    return np.where(counts == layout.MISSING_COUNT, np.nan, values).astype(np.float32)


def _time_axis(file: h5py.File, view: h5py.Group, bins: int) -> h5py.Dataset:
    """Give the one dataset of times, which each channel's group has under its own name."""
    for data in view.values():
        if layout.TIME in data:
            return data[layout.TIME]
    half_bin_s = 0.5 * BIN_SAMPLES / float(file.attrs["sample_rate_hz"])
    made = view.create_dataset(None, data=np.arange(2 * bins) * half_bin_s, compression="gzip", shuffle=True)
    write_attributes(made, {"units": "s", "long_name": "time since the first sample [s]"})
    return made
