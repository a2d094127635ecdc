"""The simulated figures of the paper, by number; figures 12 to 14 show the experiment."""

from importlib import import_module
from pathlib import Path
from types import ModuleType

FILES = {
    int(path.stem.split("_")[1]): path.stem for path in sorted(Path(__file__).parent.glob("figure_*.py"))
}


def paper_figure(number: int) -> ModuleType:
    """Return the module of a figure, with functions `studies(options)` and `draw(options, *results)`."""
    return import_module(f".{FILES[number]}", __package__)
