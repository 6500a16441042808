"""Own recordings: from what a laboratory exports to trials, envelopes and participants."""
