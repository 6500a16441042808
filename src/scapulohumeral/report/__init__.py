"""The report: results of the study as one HTML file that needs no network."""
