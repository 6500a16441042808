"""From fitted hypotheses to an answer: probabilities, classes, amplitudes, what would be seen."""
