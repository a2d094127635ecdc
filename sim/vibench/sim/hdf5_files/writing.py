"""Write HDF5 files so that a failing disk raises an error, without a crash or missing data.

HDF5 2.0 crashes if a write fails while a file is being closed, and h5py only prints errors that occur while
an object is being closed. Therefore HDF5 writes to a file object that accepts every write and stores the
first error. The error is raised after HDF5 has closed the file; a Ctrl-C is delayed until then as well.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from traceback import walk_stack
from types import FrameType
from typing import Any, Literal

import h5py

from ..operating_system.this import Buffer, write_all


class _Disk(FileIO):
    refusal: OSError | KeyboardInterrupt | None = None

    def write(self, data: Buffer) -> int:  # type: ignore[override]  # h5py passes nothing else
        try:
            write_all(self.fileno(), data, self.tell())
        except OSError as error:
            self.refusal = self.refusal or error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.refusal = self.refusal or error
            return 0


@contextmanager
def open_hdf5_to_write(
    path: Path, mode: Literal["x", "r+"], libver: tuple[str, str] | None = None
) -> Iterator[h5py.File]:
    """Open a file to create (``x``) or change (``r+``) it; raise OSError at the end if any write failed."""
    with _Disk(path, "x+" if mode == "x" else mode) as disk:
        try:
            with _interrupts(disk), h5py.File(disk, "w" if mode == "x" else mode, libver=libver) as file:
                yield file
        finally:
            if disk.refusal is not None:
                raise disk.refusal


@contextmanager
def _interrupts(disk: _Disk) -> Iterator[None]:
    """Delay a Ctrl-C (KeyboardInterrupt) that arrives inside this module until the file is closed."""
    is_reached = threading.current_thread() is threading.main_thread()
    found = {each: signal.getsignal(each) for each in (signal.valid_signals() if is_reached else ())}
    handlers: dict[int, Any] = {number: handler for number, handler in found.items() if callable(handler)}

    def on_signal(number: int, frame: FrameType | None) -> None:
        try:
            handlers[number](number, frame)
        except KeyboardInterrupt as interrupt:
            disk.refusal = disk.refusal or interrupt
            if all(each.f_code.co_filename != __file__ for each, _ in walk_stack(frame)):
                raise

    for number in handlers:
        signal.signal(number, on_signal)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if signal.getsignal(number) is on_signal:  # keep a handler that was set meanwhile
                signal.signal(number, handler)
