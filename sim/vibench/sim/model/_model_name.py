"""A contact law as one word of a command line or a file, and back from it.

hertz                     the paper's stops
linear                    no stops
linear_gap[:STIFFNESS]    springs [N/m]; without a number, as stiff as Hertz at 1 um
hunt_crossley:LOSS        Hertz with loss [s/m]
rigid:RESTITUTION         Newton's impact, 0 to 1
power:5, power:3+5+7      powers of p, fitted to Hertz at 1 um, the force there in equal parts
power:3@0.2+7@0.8         the same in other parts
"""

from ._contact_law import (
    ContactLaw,
    Hertz,
    HuntCrossley,
    LinearGap,
    NoContact,
    RigidStops,
    fitted_linear_gap,
    fitted_power_law,
)

FORMS = "hertz, linear, linear_gap[:N/m], hunt_crossley:s/m, rigid:0..1, power:3+5+7 or power:3@0.2+7@0.8"


def model_named(text: str, hertz: Hertz, gap_m: float) -> ContactLaw:
    """Turn a model's name into its law.

    Parameters
    ----------
    text
        As in the module's docstring.
    hertz, gap_m
        What a fitted law is fitted to.

    Raises
    ------
    ValueError
        When the name is not one of the forms, or its numbers are not allowed.

    """
    name, _, detail = text.strip().partition(":")
    match name, detail:
        case "hertz", "":
            return hertz
        case "linear", "":
            return NoContact()
        case "linear_gap", "":
            return fitted_linear_gap(hertz)
        case "power", _:
            return _power(detail, text, hertz, gap_m)
        case _:
            return _with_number(name, detail, text, hertz)


def _with_number(name: str, detail: str, text: str, hertz: Hertz) -> ContactLaw:
    match name:
        case "linear_gap":
            return LinearGap(_number(detail, text))
        case "hunt_crossley":
            return HuntCrossley(hertz.stiffness, _number(detail, text))
        case "rigid":
            return RigidStops(_number(detail, text))
        case _:
            raise ValueError(_unknown(text))


def _power(detail: str, text: str, hertz: Hertz, gap_m: float) -> ContactLaw:
    terms = [term.partition("@") for term in detail.split("+")]
    try:
        exponents = [int(exponent) for exponent, _, _ in terms]
    except ValueError:
        raise ValueError(_unknown(text)) from None
    if all(share == "" for _, _, share in terms):
        return fitted_power_law(exponents, hertz, gap_m)
    shares = [_number(share, text) for _, _, share in terms]
    return fitted_power_law(exponents, hertz, gap_m, shares=shares)


def _number(detail: str, text: str) -> float:
    try:
        return float(detail)
    except ValueError:
        raise ValueError(_unknown(text)) from None


def _unknown(text: str) -> str:
    return f"Contact {text!r} is not known: give one of {FORMS}."
