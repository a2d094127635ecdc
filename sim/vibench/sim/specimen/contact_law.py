"""Contact laws between m1 and its stops: union type and table of names. Each law has a separate file.

To add a law of the form F = (k1 d + k d^(3/2)) (1 + loss dd/dt) at indentation d, add its file and an entry
in `CONTACT_LAWS`. The native engine, the independent solution and harmonic balance need no change, because
they read the law's `stops`. A force of another form also needs a type in native/contact.hpp.
"""

from collections.abc import Mapping

from .hertz import HERTZ, Hertz
from .hunt_crossley import HUNT_CROSSLEY, HuntCrossley
from .linear_gap import LINEAR_GAP, LinearGap
from .no_contact import LINEAR, NoContact
from .power_law import POWER, PowerLaw
from .rigid_stops import RIGID, RigidStops
from .stops import LawWord, Reference, UnreadableLawError

ContactLaw = Hertz | NoContact | LinearGap | HuntCrossley | RigidStops | PowerLaw

CONTACT_LAWS: Mapping[str, LawWord[ContactLaw]] = {
    "hertz": HERTZ,
    "linear": LINEAR,
    "linear_gap": LINEAR_GAP,
    "hunt_crossley": HUNT_CROSSLEY,
    "rigid": RIGID,
    "power": POWER,
}
"""Contact laws by the names that the command line and files use."""


def law_by_name(text: str, contact_stiffness: float, gap_m: float) -> ContactLaw:
    """Return the contact law for a name, for example ``hertz`` or ``rigid:0.8``.

    Raises ValueError when the name is unknown, or its numbers are not allowed.

    Parameters
    ----------
    text
        A name in `CONTACT_LAWS`, followed by a colon and the numbers of the law, if any.
    contact_stiffness, gap_m
        Hertz contact to which laws without explicit numbers are fitted: k_contact [N/m^1.5] and gap [m].
    """
    reference = Reference(contact_stiffness, gap_m)
    name, _, detail = text.strip().partition(":")
    if name in CONTACT_LAWS:
        try:
            return CONTACT_LAWS[name].made(detail, reference)
        except UnreadableLawError:
            pass
    *forms, last = (law.form for law in CONTACT_LAWS.values())
    raise ValueError(f"Contact {text!r} is not known: give one of {', '.join(forms)}, {last}.")
