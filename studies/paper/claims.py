"""All claims, in the order of the page."""

from .balance_claims import BALANCE_CLAIMS
from .claim import Claim
from .collision_claims import COLLISION_CLAIMS
from .exponent_claims import EXPONENT_CLAIMS
from .resonance_claims import RESONANCE_CLAIMS
from .similarity_claims import SIMILARITY_CLAIMS
from .spectrum_claims import SPECTRUM_CLAIMS

SECTIONS: dict[str, tuple[Claim, ...]] = {
    "Resonances": RESONANCE_CLAIMS,
    "Collisions": COLLISION_CLAIMS,
    "Chaos": EXPONENT_CLAIMS,
    "Motion at 260 Hz": SPECTRUM_CLAIMS,
    "Analytical solution of the continuous model": BALANCE_CLAIMS,
    "Similarity of the models": SIMILARITY_CLAIMS,
}
CLAIMS = tuple(claim for claims in SECTIONS.values() for claim in claims)
