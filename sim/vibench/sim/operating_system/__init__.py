"""What differs between Linux, macOS and Windows: locks, writing at a place, disks, processes, folders.

`_posix` and `_windows` give the same names; which of them is meant stands in `_this`, and nowhere else is the
system asked for. The Windows one is checked by the type checker for Windows, and run by a test in a Python
from which everything was taken that Windows lacks; it was not yet run on Windows itself.
"""
