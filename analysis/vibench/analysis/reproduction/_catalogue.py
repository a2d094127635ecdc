"""All claims, in the order of the page."""

from ._balance_claims import BALANCE_CLAIMS
from ._claim import Claim
from ._collision_claims import COLLISION_CLAIMS
from ._exponent_claims import EXPONENT_CLAIMS
from ._resonance_claims import RESONANCE_CLAIMS
from ._similarity_claims import SIMILARITY_CLAIMS
from ._spectrum_claims import SPECTRUM_CLAIMS

SECTIONS: dict[str, tuple[Claim, ...]] = {
    "Resonances": RESONANCE_CLAIMS,
    "Collisions": COLLISION_CLAIMS,
    "Chaos": EXPONENT_CLAIMS,
    "Motion at 260 Hz": SPECTRUM_CLAIMS,
    "Analytical solution of the continuous model": BALANCE_CLAIMS,
    "Similarity of the models": SIMILARITY_CLAIMS,
}
CLAIMS = tuple(claim for claims in SECTIONS.values() for claim in claims)
