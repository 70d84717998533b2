"""The search for explanations, and the choice between them."""
