"""Rules test_solutions and test_results: run tests on results, with the files of this study."""

from _log import log_to_file

log_to_file(snakemake)

import pytest

from scapulohumeral.errors import DataError


class StudyFiles:
    """Hands the inputs of the rule to the tests."""

    @pytest.fixture(scope="session")
    @classmethod
    def files(cls):
        """Inputs of the rule by name."""
        return dict(snakemake.input.items())


chosen = [path for path in snakemake.input.tests if "/test_" in path]
arguments = ["-m", "results", "-ra", "-p", "no:cacheprovider", *chosen]
code = pytest.main(arguments, plugins=[StudyFiles()])
if code != pytest.ExitCode.OK:
    raise DataError(
        "Results miss what they must reach: the tests that failed are listed above. "
        "The report shows the same at its top."
    )
