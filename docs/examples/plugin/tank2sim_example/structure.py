"""A structure: the card's own terms and those of a ship that is not alike to both sides."""

from tank2sim.identification.trials.problem.structures import ASYMMETRY, ModelStructure, with_terms

ASYMMETRIC = ModelStructure(
    name="asymmetric",
    description="the card's terms and those of a ship that is not alike to both sides",
    start=lambda card: with_terms(card, ASYMMETRY),
)
