"""Rule test_results: run the tests on results, with the files of this study."""

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


arguments = ["-m", "results", "-ra", "-p", "no:cacheprovider", "tests/results"]
code = pytest.main(arguments, plugins=[StudyFiles()])
if code != pytest.ExitCode.OK:
    raise DataError(
        "Results miss what they must reach: the tests that failed are listed above. "
        "The report shows the same at its top."
    )
