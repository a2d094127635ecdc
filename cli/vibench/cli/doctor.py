"""`vibench doctor`: what a question about this installation has to say, as text to paste."""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from types import MappingProxyType

from vibench.acquisition import MissingLibrary, need_extra, shipped_folder
from vibench.acquisition.instruments import PlugInKind, plug_in_names
from vibench.acquisition.recording import KEY_VARIABLE
from vibench.acquisition.rig import TOKEN_VARIABLE
from vibench.sim.engine.library import EngineError
from vibench.sim.engine.run import native_engine
from vibench.sim.operating_system.this import LOCK_VARIABLE, VARIABLE as STATE_VARIABLE, state_place

from .output import console, print_json
from .paths import AsJson

NOT_INSTALLED = "not installed"
FOR_DEVELOPERS = frozenset({"test", "docs", "peers"})
"""Extras that no question of a user is about."""
USB_DEVICES = Path("/dev/bus/usb")
VARIABLES: Mapping[str, str] = MappingProxyType(
    {
        STATE_VARIABLE: "folder for locks, bench checks and learnt costs; the user's own if absent",
        LOCK_VARIABLE: "folder where all users of a computer see which bench is in use; /tmp if absent",
        TOKEN_VARIABLE: "token of a virtual rig that is served to other computers",
        KEY_VARIABLE: "file with the key that seals of recordings are signed with",
        "OPENBLAS_NUM_THREADS": "threads of linear algebra; 1 if absent, since the matrices are small",
        "QT_QPA_PLATFORM": "how Qt draws the window; 'offscreen' where there is no display",
        "PYQTGRAPH_QT_LIB": "binding of the window's plots; PySide6 if absent",
    }
)
"""The environment variables that vibench reads, and what each is for: docs/installation.md."""
SECRET = frozenset({TOKEN_VARIABLE})


def doctor(as_json: AsJson = False) -> None:
    """Say what this installation consists of, for a question to others: data only, nothing is changed."""
    sections = {
        "vibench": installation(),
        "libraries": dict(libraries()),
        "engine": dict(engine()),
        "folders": dict(folders()),
        "instruments": dict(instruments()),
        "plug-ins": {kind.value: ", ".join(plug_in_names(kind)) for kind in PlugInKind},
        "environment": {
            name: "(set, secret)" if name in SECRET else os.environ[name]
            for name in VARIABLES
            if name in os.environ
        },
    }
    if as_json:
        print_json(sections)
        return
    for title, facts in sections.items():
        console.print(f"{title}:")
        for name, said in facts.items():
            console.print(f"  {name}: {said}")


def installation() -> dict[str, str]:
    """Return versions and places of vibench, Python and system."""
    library = " ".join(platform.libc_ver()).strip()
    return {
        "version": version("vibench"),
        "shipped files": str(shipped_folder("campaigns").parent),
        "python": f"{platform.python_version()} at {sys.executable}",
        "system": f"{platform.platform()}{f', {library}' if library else ''}",
        "processors": str(os.cpu_count()),
    }


def libraries() -> Iterator[tuple[str, str]]:
    """Yield the version of each library that vibench asks for; of one that is missing, who brings it."""
    asking: dict[str, list[str]] = {}
    for requirement in requires("vibench") or ():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        extra = re.search(r"""extra == ['"](\w+)['"]""", requirement)
        asking.setdefault(name, []).append(extra[1] if extra else "")
    sizes = Counter(extra for extras in asking.values() for extra in extras)
    for name, extras in asking.items():
        # Extras bring others: the one that asks for the fewest libraries brings the least.
        smallest = min(set(extras) - FOR_DEVELOPERS, key=sizes.__getitem__, default=None)
        if name == "vibench" or smallest is None:
            continue
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, f"{NOT_INSTALLED}{f' (extra {smallest})' if smallest else ''}"


def engine() -> Iterator[tuple[str, str]]:
    """Load the native engine, and give its place, its family and whether it answers a known scene."""
    try:
        loaded = native_engine()
    except (EngineError, OSError, subprocess.CalledProcessError) as error:
        yield "library", f"cannot be used: {error}"
        return
    yield "library", str(loaded.path)
    yield "processor family", loaded.family
    yield "self-test", "passed"


def folders() -> Iterator[tuple[str, str]]:
    """Yield where vibench keeps what it learns, and whether it may write there."""
    yield "state", _place(state_place())
    yield "this folder", _place(Path.cwd())


def _place(folder: Path) -> str:
    standing = next(each for each in (folder, *folder.parents) if each.exists())
    may = "writable" if standing.is_dir() and os.access(standing, os.W_OK) else "NOT writable"
    return f"{folder}, {may}, {shutil.disk_usage(standing).free / 1e9:.1f} GB free"


def instruments() -> Iterator[tuple[str, str]]:
    """Yield what can be seen of instruments, and what stands in between: libraries, drivers, permissions."""
    try:
        need_extra("bench")
    except MissingLibrary as error:
        yield "libraries", str(error)
        return
    from vibench.acquisition import list_instruments

    found = list_instruments()
    yield "VISA", ", ".join(found.visa_resources) or "no instrument"
    yield "DAQmx", ", ".join(str(device.name) for device in found.daq_devices) or "no device"
    for number, remark in enumerate(found.remarks, 1):
        yield f"remark {number}", remark
    if USB_DEVICES.is_dir():
        devices = [path for path in USB_DEVICES.glob("*/*") if not path.is_dir()]
        mine = sum(os.access(path, os.R_OK | os.W_OK) for path in devices)
        yield "USB devices", f"{mine} of {len(devices)} may be opened by this account"
