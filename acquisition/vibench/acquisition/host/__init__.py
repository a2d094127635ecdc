"""Host-computer services: TOML files, shipped files, threads for work that may hang.

`FrozenModel` is the base of every validated value; an error in a file is reported with file, key, what was
given and what is allowed. This package does not deal with measurements.
"""
