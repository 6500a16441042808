"""How each effect would show: derivatives of the optimal movement."""
