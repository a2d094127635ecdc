"""Differences between Linux, macOS and Windows: locks, writes at an offset, disks, processes, folders.

`posix` and `windows` have the same functions; only `this` chooses between them. `windows` is type-checked for
Windows, and tested in a Python without the functions missing on Windows. It has not yet been run on Windows.
"""
