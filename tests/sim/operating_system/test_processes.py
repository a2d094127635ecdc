"""A process is identified by its number and start time, also across containers and computers."""

import os
import sys
from pathlib import Path

import pytest

from vibench.sim.operating_system.this import Place, is_process, place_of, process_start

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="how Linux numbers its starts")


def test_the_start_time_of_a_process_distinguishes_containers_and_computers():
    own = process_start(os.getpid())
    boot, container, ticks = own.split("_")
    assert place_of(own) is Place.HERE
    assert place_of(f"{boot}_{container}_1") is Place.HERE
    assert place_of(f"{boot}_1_{ticks}") is Place.CONTAINER
    assert place_of(f"another_{container}_{ticks}") is Place.ELSEWHERE
    assert not is_process(os.getpid(), f"{boot}_1_{ticks}")


def test_processes_are_identified_without_the_boot_time(monkeypatch):
    from vibench.sim.operating_system import posix as _posix

    read = Path.read_text

    def hidden(path, *arguments, **named):
        if path.name == "boot_id":
            raise PermissionError(13, "hidden", str(path))
        return read(path, *arguments, **named)

    monkeypatch.setattr(Path, "read_text", hidden)
    _posix._here.cache_clear()
    try:
        start = process_start(os.getpid())
        assert is_process(os.getpid(), start)
        assert place_of(start) is Place.HERE
    finally:
        _posix._here.cache_clear()
