"""`vibench doctor`: facts about this installation, to be pasted into a problem report."""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from itertools import chain
from pathlib import Path

from vibench.acquisition import MissingLibrary, require_extra, shipped_folder
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
"""Extras (optional dependencies) that only developers need."""
USB_DEVICES = Path("/dev/bus/usb")
VARIABLES: Mapping[str, str] = {
    STATE_VARIABLE: "folder for locks, bench checks and measured run times; by default in the user's files",
    LOCK_VARIABLE: "folder of the locks that all users of a computer share; by default /tmp",
    TOKEN_VARIABLE: "token of a virtual rig served to other computers",
    KEY_VARIABLE: "key file for signing the seals of recordings",
    "OPENBLAS_NUM_THREADS": "threads of linear algebra; default 1, because the matrices are small",
    "MALLOC_MMAP_THRESHOLD_": "block size above which background processes on Linux return memory "
    "immediately [bytes]; default 4 MiB",
    "QT_QPA_PLATFORM": "Qt's platform plug-in; 'offscreen' without a display",
    "PYQTGRAPH_QT_LIB": "Qt binding of the plots; default PySide6",
}
"""Environment variables of vibench and their meaning, as in docs/installation.md."""
SECRET = frozenset({TOKEN_VARIABLE})


def doctor(as_json: AsJson = False) -> None:
    """Report versions, folders, libraries and instruments of this installation; nothing is changed."""
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
        for name, fact in facts.items():
            console.print(f"  {name}: {fact}")


def installation() -> dict[str, str]:
    """Return versions and folders of vibench, Python and the operating system."""
    library = " ".join(platform.libc_ver()).strip()
    return {
        "version": version("vibench"),
        "shipped files": str(shipped_folder("campaigns").parent),
        "python": f"{platform.python_version()} at {sys.executable}",
        "system": f"{platform.platform()}{f', {library}' if library else ''}",
        "processors": str(os.cpu_count()),
    }


def libraries() -> Iterator[tuple[str, str]]:
    """Yield each library and plug-in package with its version or, if missing, the extra that installs it."""
    rows = (row for kind in PlugInKind for row in entry_points(group=kind.value))
    packages = {row.dist.name: row.dist.requires or () for row in rows if row.dist is not None}
    asking: dict[str, list[str]] = {}
    for requirement in chain(requires("vibench") or (), packages, *packages.values()):
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        extra = re.search(r"""extra == ['"](\w+)['"]""", requirement)
        asking.setdefault(name, []).append(extra[1] if extra else "")
    sizes = Counter(extra for extras in asking.values() for extra in extras)
    for name, extras in asking.items():
        # If several extras contain the library, name the extra with the fewest libraries.
        smallest = min(set(extras) - FOR_DEVELOPERS, key=sizes.__getitem__, default=None)
        if name == "vibench" or smallest is None:
            continue
        try:
            yield name, version(name)
        except PackageNotFoundError:
            yield name, f"{NOT_INSTALLED}{f' (extra {smallest})' if smallest else ''}"


def engine() -> Iterator[tuple[str, str]]:
    """Load and self-test the native engine; yield its path, processor family and test result."""
    try:
        loaded = native_engine()
    except (EngineError, OSError, subprocess.CalledProcessError) as error:
        yield "library", f"cannot be used: {error}"
        return
    yield "library", str(loaded.path)
    yield "processor family", loaded.family
    yield "self-test", "passed"


def folders() -> Iterator[tuple[str, str]]:
    """Yield the folders in which vibench stores data, and whether they can be written to."""
    yield "state", _place(state_place())
    yield "this folder", _place(Path.cwd())


def _place(folder: Path) -> str:
    standing = next(each for each in (folder, *folder.parents) if each.exists())
    may = "writable" if standing.is_dir() and os.access(standing, os.W_OK) else "NOT writable"
    return f"{folder}, {may}, {shutil.disk_usage(standing).free / 1e9:.1f} GB free"


def instruments() -> Iterator[tuple[str, str]]:
    """Yield the instruments found, with libraries, drivers and permissions."""
    try:
        require_extra("bench")
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
