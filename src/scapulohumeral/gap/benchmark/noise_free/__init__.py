"""What noise-free curves of opened keys tell of the gap on a hidden task, and of where it shows."""
