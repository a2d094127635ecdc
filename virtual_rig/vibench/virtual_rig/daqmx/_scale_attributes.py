"""What a program can ask about a custom scale."""

from typing import Any

from ._attributes import Attribute, AttributeGroup, not_supported
from ._scales import LinearScale, PolynomialScale, Scale, TableScale


def _linear(scale: Scale) -> LinearScale:
    match scale:
        case LinearScale():
            return scale
        case _:
            raise not_supported("Scale.LIN", f"Scale: {scale.name} ({scale.kind.name})")


def _table(scale: Scale) -> TableScale:
    match scale:
        case TableScale():
            return scale
        case _:
            raise not_supported("Scale.TABLE", f"Scale: {scale.name} ({scale.kind.name})")


def _polynomial(scale: Scale) -> PolynomialScale:
    match scale:
        case PolynomialScale():
            return scale
        case _:
            raise not_supported("Scale.POLY", f"Scale: {scale.name} ({scale.kind.name})")


SCALE: AttributeGroup[Any] = AttributeGroup(
    "Scale",
    {
        "DESCR": Attribute(lambda _: ""),
        "SCALED_UNITS": Attribute(lambda scale: scale.scaled_units),
        "PRE_SCALED_UNITS": Attribute(lambda scale: scale.pre_scaled_units),
        "TYPE": Attribute(lambda scale: scale.kind),
        "LIN_SLOPE": Attribute(lambda scale: _linear(scale).slope),
        "LIN_Y_INTERCEPT": Attribute(lambda scale: _linear(scale).intercept),
        "TABLE_PRE_SCALED_VALS": Attribute(lambda scale: _table(scale).pre_scaled),
        "TABLE_SCALED_VALS": Attribute(lambda scale: _table(scale).scaled),
        "MAP_PRE_SCALED_MIN": Attribute(lambda scale: _table(scale).pre_scaled[0]),
        "MAP_PRE_SCALED_MAX": Attribute(lambda scale: _table(scale).pre_scaled[-1]),
        "MAP_SCALED_MIN": Attribute(lambda scale: _table(scale).scaled[0]),
        "MAP_SCALED_MAX": Attribute(lambda scale: _table(scale).scaled[-1]),
        "POLY_FORWARD_COEFF": Attribute(lambda scale: _polynomial(scale).forward_coefficients),
        "POLY_REVERSE_COEFF": Attribute(lambda scale: _polynomial(scale).reverse_coefficients),
    },
)
