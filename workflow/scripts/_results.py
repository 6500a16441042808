"""Tests on results, run by the rules of results with the files of this study."""

from typing import Any

import pytest

from scapulohumeral.errors import DataError


def run_tests(snakemake: Any) -> None:
    """Run the test modules among a rule's inputs; the fixture `files` holds all its inputs by name.

    Raises
    ------
    DataError                        a test failed
    """

    class StudyFiles:
        """Hands the inputs of the rule to the tests."""

        @pytest.fixture(scope="session")
        @classmethod
        def files(cls):
            """Inputs of the rule by name."""
            return dict(snakemake.input.items())

    chosen = [path for path in snakemake.input.tests if "/test_" in path]
    arguments = ["-m", "results", "-ra", "-p", "no:cacheprovider", *chosen]
    if pytest.main(arguments, plugins=[StudyFiles()]) != pytest.ExitCode.OK:
        raise DataError(
            "Results miss what they must reach: the tests that failed are listed above, each with "
            "the file that it is about."
        )
