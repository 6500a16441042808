"""Draws whose keys are open: what weights of evidence are fitted to, and what each stage adds."""
