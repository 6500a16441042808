"""What is kept of an opened draw says the same as its files."""

from dataclasses import replace

import pytest
from open_cases import GAIN, START, TEAR, open_case

from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.open_draws.open_cases import (
    ELSEWHERE,
    PAIRS_ELSEWHERE,
    near,
    read_opened,
    write_opened,
)
from scapulohumeral.gap.isolation.hypothesis import Direction
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.verdict.posterior import Score

pytestmark = pytest.mark.unit


def with_many(present=True):
    """Beside two rivals forty labels, and forty pairs, that are improbable each."""
    case = open_case(5.0, present=present, p_value=0.3)
    ways = (Direction(9.0, 0.5), Direction(2.0, 1.5))
    others = {
        f"body/x/{i}": Score(-6.0, -0.1 * i, -0.2 * i, moves=0.2 * i, directions=ways)
        for i in range(40)
    }
    pairs = {f"body/x/{i} + {GAIN}": Score(-9.0, 9.0, 8.0, 0.01) for i in range(40)}
    return replace(case, scores={**case.scores, **others, **pairs})


def test_labels_that_are_improbable_each_count_as_one() -> None:
    case = with_many()
    kept = near(case, START)
    assert set(kept) == {TEAR, GAIN, MOVED, NONE, NO_GAP, ELSEWHERE, PAIRS_ELSEWHERE}
    whole, less = (replace(case, scores=s).probabilities(START) for s in (case.scores, kept))
    for label in (TEAR, GAIN, MOVED):
        assert less.labels[label] == pytest.approx(whole.labels[label])
    assert less.none == pytest.approx(whole.none)
    for name, pair in ((ELSEWHERE, False), (PAIRS_ELSEWHERE, True)):
        p = sum(
            x for label, x in whole.labels.items() if (" + " in label) == pair and "/x/" in label
        )
        assert less.labels[name] == pytest.approx(p)


def test_tables_are_read_as_written(tmp_path) -> None:
    cases = [with_many(), replace(with_many(present=False), name="b2", draw="two")]
    cases.append(replace(cases[0], name="c3", right=(*cases[0].right, MOVED)))
    write_opened(cases, tmp_path / "opened", START)
    again = read_opened(tmp_path / "opened")
    told = [[(c.draw, c.name, c.right, c.cause) for c in some] for some in (again, cases)]
    assert told[0] == told[1]
    for case, read in zip(cases, again, strict=True):
        assert read.about == case.about
        assert read.p_cause(START) == pytest.approx(case.p_cause(START), rel=1e-3)


def test_tables_that_are_written_again_stay(tmp_path) -> None:
    write_opened([with_many()], tmp_path / "first", START)
    write_opened(read_opened(tmp_path / "first"), tmp_path / "second", START)
    for table in ("cases.csv", "hypotheses.csv"):
        assert (tmp_path / "second" / table).read_text() == (tmp_path / "first" / table).read_text()


def test_a_task_alone_has_no_predictive_density(tmp_path) -> None:
    case = open_case(5.0)
    alone = {label: replace(score, log_predictive=None) for label, score in case.scores.items()}
    write_opened([replace(case, scores=alone)], tmp_path, START)
    [read] = read_opened(tmp_path)
    assert read.scores[TEAR].log_predictive is None
    assert read.scores[TEAR].log_evidence == 5.0


def test_a_table_that_is_not_there_or_spoilt_is_named(tmp_path) -> None:
    with pytest.raises(DataError, match="cases.csv"):
        read_opened(tmp_path)
    write_opened([open_case(5.0)], tmp_path, START)
    table = tmp_path / "hypotheses.csv"
    table.write_text(table.read_text().replace("log_prior", "prior"))
    with pytest.raises(DataError, match="log_prior"):
        read_opened(tmp_path)
