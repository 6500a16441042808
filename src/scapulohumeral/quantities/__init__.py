"""What solutions mean: angles, rhythm, joint force, moments, tracking errors."""
