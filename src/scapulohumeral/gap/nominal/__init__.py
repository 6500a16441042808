"""The participant's model, and its optimal movement without effects."""
