"""Where vibench's own configurations and campaigns lie."""

import sysconfig
from pathlib import Path

from ..errors import ConfigurationError

FOLDERS = (
    Path(__file__).resolve().parents[4],  # a checkout, or an editable install of one
    Path(sysconfig.get_path("data")) / "share" / "vibench",  # installed from a wheel
)


def shipped(name: str) -> Path:
    """Path of a file that comes with vibench, ``"hardware_configs/virtual_rig.toml"`` for example."""
    for folder in FOLDERS:
        path = folder / name
        if path.is_file():
            return path
    raise ConfigurationError(f"{name} is not part of this installation; give the path of your own file")


def all_shipped(folder: str) -> tuple[Path, ...]:
    """Every TOML file that comes with vibench in a folder, ``"campaigns"`` for example, by name."""
    found = next((place / folder for place in FOLDERS if (place / folder).is_dir()), None)
    return () if found is None else tuple(sorted(found.glob("*.toml")))
