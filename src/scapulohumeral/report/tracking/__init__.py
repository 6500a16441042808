"""Chapter on tracked elevations."""
