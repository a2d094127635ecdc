"""Custom scales: from the converter's volts to the user's units and back."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from nidaqmx.constants import ScaleType
from numpy.typing import NDArray

Values = NDArray[np.float64]


class Scale(Protocol):
    """A named map between pre-scaled and scaled values."""

    @property
    def kind(self) -> ScaleType:
        """Its DAQmx type."""

    @property
    def name(self) -> str:
        """The name programs use."""

    @property
    def pre_scaled_units(self) -> int:
        """DAQmx unit code of the values before scaling."""

    @property
    def scaled_units(self) -> str:
        """The user's unit."""

    def forward(self, values: Values) -> Values:
        """Pre-scaled values (volts) to scaled ones."""

    def inverse(self, values: Values) -> Values:
        """Scaled values to pre-scaled ones."""


@dataclass(frozen=True)
class LinearScale:
    """Slope and intercept."""

    name: str
    pre_scaled_units: int
    scaled_units: str
    slope: float
    intercept: float
    kind = ScaleType.LINEAR

    def forward(self, values: Values) -> Values:
        """``slope x + intercept``."""
        return self.slope * values + self.intercept

    def inverse(self, values: Values) -> Values:
        """Solve the line for x."""
        return (values - self.intercept) / self.slope


@dataclass(frozen=True)
class TableScale:
    """Points joined by straight lines; both columns ascend. Also a range mapped onto a range (two points)."""

    name: str
    pre_scaled_units: int
    scaled_units: str
    pre_scaled: tuple[float, ...]
    scaled: tuple[float, ...]
    kind: ScaleType = ScaleType.TABLE

    def forward(self, values: Values) -> Values:
        """Along the table; clipped at its ends."""
        return np.asarray(np.interp(values, self.pre_scaled, self.scaled))

    def inverse(self, values: Values) -> Values:
        """Back along the table; clipped at its ends."""
        return np.asarray(np.interp(values, self.scaled, self.pre_scaled))


@dataclass(frozen=True)
class PolynomialScale:
    """Two polynomials, coefficients from the constant upwards."""

    name: str
    pre_scaled_units: int
    scaled_units: str
    forward_coefficients: tuple[float, ...]
    reverse_coefficients: tuple[float, ...]
    kind = ScaleType.POLYNOMIAL

    def forward(self, values: Values) -> Values:
        """Evaluate the forward polynomial."""
        return np.asarray(np.polynomial.polynomial.polyval(values, self.forward_coefficients))

    def inverse(self, values: Values) -> Values:
        """Evaluate the reverse polynomial, as the caller gave it."""
        return np.asarray(np.polynomial.polynomial.polyval(values, self.reverse_coefficients))
