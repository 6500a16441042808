"""What was published: by the paper, and of healthy people."""
