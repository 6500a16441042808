"""From plans to cases: who is drawn, what is simulated, which files and keys are written."""
