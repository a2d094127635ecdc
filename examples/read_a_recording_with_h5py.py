"""Read a recording with h5py alone, without vibench: the signal played, and the peak velocity of m0.

    python examples/read_a_recording_with_h5py.py recordings/noise.h5

The file is described in docs/recording-format.md.
"""

import json
import sys

import h5py
import numpy as np

with h5py.File(sys.argv[1]) as file:
    print(f"{file.attrs['state'].decode()}: {file.attrs['reason'].decode()}")
    plan = json.loads(file["configuration/plan_json"][()])
    print(f"played: {plan['excitation']['kind']}, {plan['excitation']['amplitude_vpp']} Vpp")

    velocity = file["m0_velocity"]
    counts = velocity[:]
    metres_per_second = np.where(
        counts == velocity.attrs["_FillValue"],  # a sample that was lost
        np.nan,
        counts * velocity.attrs["scale_factor"] + velocity.attrs["add_offset"],
    )
    duration_s = counts.size * file["time"].attrs["scale_factor"]
    print(f"m0: {duration_s:.2f} s, at most {1e3 * np.nanmax(abs(metres_per_second)):.1f} mm/s")
