"""Optimal control: direct collocation on opty, exact derivatives, IPOPT."""
