"""Upright stripes for bands of frequency: where a collision is predicted."""

import pyqtgraph as pg

from .plot import Ink, Plot


class Stripes:
    """As many stripes as there are bands; those that are not needed are hidden."""

    def __init__(self, plot: Plot, ink: Ink) -> None:
        self._plot, self._ink = plot, ink
        self._regions: list[pg.LinearRegionItem] = []

    def show_bands(self, bands: tuple[tuple[float, float], ...]) -> None:
        """Show these bands, from low to high each."""
        while len(self._regions) < len(bands):
            self._regions.append(self._plot.region(self._ink))
        for number, region in enumerate(self._regions):
            region.setVisible(number < len(bands))
            if number < len(bands):
                self._plot.place(region, *bands[number])
