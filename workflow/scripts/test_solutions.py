"""Rule test_solutions: run the tests on solutions."""

from _log import log_to_file

log_to_file(snakemake)

from _results import run_tests

run_tests(snakemake)
