"""The answer as tables, figures and a page."""
