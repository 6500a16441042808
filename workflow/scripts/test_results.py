"""Rule test_results: run the tests on tables and on the report."""

from _log import log_to_file

log_to_file(snakemake)

from _results import run_tests

run_tests(snakemake)
