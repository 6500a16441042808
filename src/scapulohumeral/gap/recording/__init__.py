"""What was measured: trials, participants, and what is compared of them."""
