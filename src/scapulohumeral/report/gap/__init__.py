"""Chapter on the gap between recordings and simulations."""
