"""Every rule that computes has the hash of its code among its parameters."""

import re
from pathlib import Path

import pytest
from places import REPOSITORY

from scapulohumeral import provenance

pytestmark = pytest.mark.workflow

RULE = re.compile(r"^rule (\w+):\n((?:[ \t].*\n|\n)*)", re.MULTILINE)
# What is drawn, and answered, once: code must not draw it anew.
ONCE = "blind.smk"


def rules() -> dict[str, str]:
    """Text of each rule that runs a script or a command of the package."""
    files = sorted((REPOSITORY / "workflow/rules").glob("*.smk"))
    text = "".join(path.read_text(encoding="utf-8") for path in files if path.name != ONCE)
    found = dict(RULE.findall(text))
    runs = re.compile(r"script:|python -m")
    return {name: body for name, body in found.items() if runs.search(body)}


@pytest.mark.parametrize("name", rules())
def test_rule_watches_the_code_that_it_runs(name: str) -> None:
    body = rules()[name]
    params = body.partition("    params:\n")[2]
    [names] = re.findall(r"code=code_of\(([^)]*)\)", params)
    if "script:" in body:
        assert f"../scripts/{name}.py" in body
        assert f'"{name}"' in names
    else:
        assert '"scapulohumeral.' in names


def test_rules_that_compare_with_recordings_have_the_parameters_of_what_they_share() -> None:
    """What `against_files` reads has to stand in each rule whose script calls it."""
    scripts = (REPOSITORY / "workflow/scripts").glob("[!_]*.py")
    sharing = [path.stem for path in scripts if "against_files(" in path.read_text("utf-8")]
    assert len(sharing) >= 2
    for name in sharing:
        assert "**AGAINST," in rules()[name], name


@pytest.mark.parametrize("name", ["test_solutions", "test_results"])
def test_rule_of_results_watches_the_code_of_its_tests(name: str, repository: Path) -> None:
    """What these modules import in turn is watched with them."""
    bodies = rules()
    listed = re.findall(r'"(tests/.+\.py)"', bodies["test_solutions"])
    of_solutions = {repository / path for path in listed}
    rest = set((repository / "tests/results").glob("*.py")) - of_solutions
    imported = {
        module
        for path in (of_solutions if name == "test_solutions" else rest)
        for what in provenance.imported_names(path, path.stem)
        for module in (what, what.rpartition(".")[0])
        if module
    }
    found = {provenance.source_file(module, provenance.SOURCE_ROOT) for module in imported}
    watched = re.findall(r'"((?:scapulohumeral|simulated_persons)\.[\w.]+)"', bodies[name])
    assert found - {None} <= {path for one in watched for path in provenance.code_of(one)}
