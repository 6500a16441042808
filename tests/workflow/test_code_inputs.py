"""Every rule with a script names all source files that its script loads, but for the log."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from places import REPOSITORY

from scapulohumeral import provenance

pytestmark = pytest.mark.workflow

RULE = re.compile(r"^rule (\w+):\n((?:[ \t].*\n|\n)*)", re.MULTILINE)


def rules_with_script() -> dict[str, str]:
    """Text of each rule that runs a script."""
    folder = REPOSITORY / "workflow/rules"
    text = "".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.smk")))
    return {name: body for name, body in RULE.findall(text) if "script:" in body}


def watched_code(body: str) -> set[Path]:
    """Source files of both packages that a rule names."""
    modules = re.findall(r'"((?:scapulohumeral|simulated_persons)\.[\w.]+)"', body)
    return {path for module in modules for path in provenance.code_of(module)}


@pytest.mark.parametrize("name", rules_with_script())
def test_rule_watches_the_code_of_its_script(
    name: str, repository: Path, code_behind: Callable[[Path], set[Path]]
) -> None:
    body = rules_with_script()[name]
    assert f"../scripts/{name}.py" in body
    watched = watched_code(body)
    scripts = repository / "workflow/scripts"
    for helper in re.findall(r'"(_\w+)"', body):
        watched |= set(provenance.code_of(helper, scripts))
    loaded = set(provenance.code_of(name, scripts))
    helpers = loaded - {scripts / f"{name}.py", scripts / "_log.py"}
    assert code_behind(scripts / f"{name}.py") | helpers <= watched


@pytest.mark.parametrize("name", ["test_solutions", "test_results"])
def test_rule_of_results_watches_the_code_of_its_tests(name: str, repository: Path) -> None:
    """What these modules import in turn is watched with them."""
    bodies = rules_with_script()
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
    assert found - {None} <= watched_code(bodies[name])
