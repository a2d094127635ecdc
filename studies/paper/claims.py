"""All claims, in the order of the page on the claims."""

from . import (
    balance_claims,
    collision_claims,
    exponent_claims,
    resonance_claims,
    similarity_claims,
    spectrum_claims,
)
from .claim import Claim

SECTIONS: dict[str, tuple[Claim, ...]] = {
    heading: tuple(each for each in vars(module).values() if isinstance(each, Claim))
    for heading, module in {
        "Resonances": resonance_claims,
        "Collisions": collision_claims,
        "Chaos": exponent_claims,
        "Motion at 260 Hz": spectrum_claims,
        "Analytical solution of the continuous model": balance_claims,
        "Similarity of the models": similarity_claims,
    }.items()
}
"""Claims by heading; within a section, claims have the order of the section's source file."""
CLAIMS = tuple(claim for claims in SECTIONS.values() for claim in claims)
