"""What can be set, with meaning, unit and range of every key, and the refusal of anything else."""
