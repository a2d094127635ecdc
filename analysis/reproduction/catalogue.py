"""All claims, in the order of the page."""

from .claim import Claim
from .collision_claims import COLLISION_CLAIMS
from .resonance_claims import RESONANCE_CLAIMS
from .spectrum_claims import SPECTRUM_CLAIMS

SECTIONS: dict[str, tuple[Claim, ...]] = {
    "Resonances": RESONANCE_CLAIMS,
    "Collisions": COLLISION_CLAIMS,
    "Motion at 260 Hz": SPECTRUM_CLAIMS,
}
CLAIMS = tuple(claim for claims in SECTIONS.values() for claim in claims)
