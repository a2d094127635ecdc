"""What the computer provides: TOML files in and out, shipped files, work that may hang.

`FrozenModel` is the base of every validated value; what a file says wrongly is refused with file, key,
what was given and what is allowed. Knows nothing of measurements.
"""
