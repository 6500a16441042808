"""Stages of the study: what the rules of the workflow run, from files to files."""
