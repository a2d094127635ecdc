"""Services of the host computer: TOML files, shipped files, and threads for work that may hang.

`FrozenModel` is the base of every validated value; an error in a file is reported with file, key, what was
given and what is allowed. This package does not deal with measurements.
"""
