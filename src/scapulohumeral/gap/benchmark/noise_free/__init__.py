"""What noise-free curves of opened keys tell: the gap on a hidden task, and what limits answers."""
