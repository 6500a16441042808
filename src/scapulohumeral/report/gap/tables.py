"""Tables of the diagnosis of the gap: answers ``result.json`` and the score card of blind cases.

The documents are read as they are; what makes them lies in the package that uses this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from scapulohumeral.quantities.proportion import percent, wilson95
from scapulohumeral.report.gap.words import TESTS
from scapulohumeral.report.tables import Table

SHOWN_CANDIDATES = 5
# How often 90 % sets hold the truth, by kind of case: told by the rows of a card's cases, which the
# first cards have too.
HELD, SINGLES, OTHERS = "held", "singles", "others"
# Rows of the score card, rates, medians and numbers: name, path in the scores of a plant, bar.
SCORES = (
    ("false alarms on cases without effect", ("false_alarms",), "at most 5 %"),
    ("effects twice the smallest detectable: gap found", ("large", "detection"), "at least 95 %"),
    ("there: family right, most probable", ("large", "family_top1"), "at least 80 %"),
    ("there: class right", ("large", "class_top1"), "at least 88 %"),
    ("there: the injected effect itself", ("large", "effect_top1"), ""),
    (
        "there: by the same rule, baseline: rules of thumb",
        ("large", "baselines", "rule_based"),
        "20 points below",
    ),
    ("all effects that show: gap found", ("detection",), ""),
    ("family right, most probable", ("family_top1",), "65 % with EMG, reference"),
    ("the injected effect itself, not another movement", ("effect_top1",), ""),
    ("by the same rule, baseline: prior only", ("baselines", "prior_only"), ""),
    ("by the same rule, baseline: cosine", ("baselines", "cosine"), ""),
    ("by the same rule, baseline: BIC of single samples", ("baselines", "per_sample_bic"), ""),
    ("by the same rule, baseline: screening alone", ("baselines", "screening"), ""),
    ("by the same rule, baseline: rules of thumb", ("baselines", "rule_based"), ""),
    ("family among the three most probable", ("family_top3",), ""),
    ("class right", ("class_top1",), ""),
    ("side right", ("side_top1",), ""),
    ("channel with the largest change named", ("regions", "largest_channel"), "at least 85 %"),
    (
        "effects whose size cannot be compared: family right, most probable",
        ("without_size", "family_top1"),
        "",
    ),
    ("another movement named, where nothing else shows", ("moved", "named"), ""),
    ("90 % set holds the truth, all cases", ("set90", "coverage"), "85 to 97 %"),
    ("90 % set holds the truth, single effects", (HELD, SINGLES), ""),
    ("90 % set holds the truth, all others", (HELD, OTHERS), ""),
    ("answers above 0.8 that are wrong", ("sure_and_wrong",), "at most 10 %"),
    (
        "unknown causes, near a known one: rejected",
        ("unknown", "rejected", "near"),
        "at least 50 %",
    ),
    ("unknown causes, far from all: rejected", ("unknown", "rejected", "far"), "at least 85 %"),
    (
        "single effects without a verdict, which set no threshold for that",
        ("unknown", "singles_without_verdict"),
        "",
    ),
    (
        "pairs: both families, or one and that something is left",
        ("pairs", "both_or_one_and_more"),
        "at least 70 %",
    ),
    ("right singles of which something is said to be left", ("says_more",), ""),
    ("answers that abstain", ("abstention",), ""),
    ("right effect keeps 70 % of the gap on a new task", ("shrinkage", "keeps"), ""),
)
MEDIANS = (
    ("channels and phases where the gap shows: F1, median", ("regions", "f1"), "at least 0.80"),
    (
        "effects twice the smallest detectable: relative error of amplitude, median",
        ("large", "amplitude", "relative_error"),
        "at most 0.12",
    ),
    (
        "there: right cause, on a new task: removed of the reducible gap, median",
        ("large", "shrinkage", "new_task"),
        "at least 0.70",
    ),
    (
        "there: error of that share, median",
        ("large", "shrinkage", "error"),
        "at most 0.10",
    ),
    ("all effects that show: relative error of amplitude", ("amplitude", "relative_error"), ""),
    (
        "named effects: relative error of amplitude, median",
        ("amplitude", "relative_error_named"),
        "at most 0.12",
    ),
    ("error of the share removed on a new task, median", ("shrinkage", "error"), ""),
    ("right cause, on held-out trials: removed, median", ("shrinkage", "held_out_trial"), ""),
    ("black box there", ("shrinkage", "black_box_on_held_out_trial"), ""),
    ("best of three placebos there", ("shrinkage", "best_placebo_on_held_out_trial"), ""),
    ("right cause, on the hidden task: removed, median", ("shrinkage", "true_on_hidden_task"), ""),
    (
        "oracle (injected effect), on the hidden task: removed, median",
        ("shrinkage", "oracle_on_hidden_task"),
        "",
    ),
    (
        "right cause, on the hidden task: removed of the gap without any floor, median",
        ("shrinkage", "removed_without_noise"),
        "",
    ),
    ("time of a diagnosis, median [s]", ("seconds",), "at most 180"),
)
NUMBERS = (
    ("labels in a 90 % set, mean", ("set90", "mean_size"), "at most 6 with EMG, reference"),
    ("calibration error of the first family", ("calibration", "ece"), "at most 0.08"),
    (
        "its mean if answers are right as often as they say",
        ("calibration", "by_chance", "mean"),
        "",
    ),
)


# Plants of score cards. Persons of the first two are simulated.
PLANTS = {
    "P1": "Simulated arms",
    "P2": "Persons simulated by OpenSim",
    "S": "Recorded motion, disturbed",
}
SIMULATED = ("P1", "P2")
# Rule of cards that count gaps in answers that abstain; earlier ones, the first without rules, left
# these out.
ALARMS_COUNTED = "claims_gap"
# Scores by one threshold over all cases of a plant, told in that column alone: older cards hold one
# for each column.
OF_ALL = "unknown"
# Columns of the history of draws: name, path in the scores of simulated persons.
DRAW_SCORES = (
    ("false alarms", ("false_alarms",)),
    ("gap found", ("detection",)),
    ("family right", ("family_top1",)),
    ("class right", ("class_top1",)),
    ("twice the smallest detectable: family right", ("large", "family_top1")),
    ("there: class right", ("large", "class_top1")),
    ("90 % set holds the truth", ("set90", "coverage")),
)


def verdict_table(diagnoses: Sequence[Mapping[str, Any]]) -> Table:
    """One row per participant: is there a gap, where, which cause, how far it shrinks."""
    rows = [
        (
            d["inputs"]["participant"],
            *_gap(d),
            _place(d["regions"]["enters"], "name"),
            _place(d["regions"]["shows"], "channel"),
            _cause(d),
            f"{percent(d['none_p'])} / {percent(d['no_gap_p'])}",
            _shrinkage(d),
        )
        for d in diagnoses
    ]
    columns = (
        "participant",
        "gap",
        "p",
        "by which test",
        "size [sigma]",
        "where it enters",
        "where it shows",
        "most probable cause",
        "none of these / no gap",
        "gap removed",
    )
    return Table(columns, rows, frozenset(i for i, d in enumerate(diagnoses) if _undecided(d)))


def candidate_table(diagnosis: Mapping[str, Any]) -> Table:
    """The most probable causes with their amplitudes, and what they leave unexplained."""
    rows = []
    for candidate in diagnosis["candidates"][:SHOWN_CANDIDATES]:
        sizes = "; ".join(_amplitude(p) for p in candidate["parameters"])
        inside = candidate["label"] in diagnosis["set90"]
        share = percent(candidate["unexplained_share"])
        rows.append(
            (candidate["label"], percent(candidate["p"]), sizes, share, "yes" if inside else "no")
        )
    return Table(("cause", "probability", "size", "unexplained", "in the 90 % set"), rows)


def draw_table(cards: Sequence[Mapping[str, Any]]) -> Table:
    """Headline scores on simulated persons of every draw of blind cases, one row per plant.

    Parameters
    ----------
    cards : score cards, the latest last; rates carry their Wilson 95 % intervals
    """
    rows = []
    drawn = [(card, name) for card in cards for name in SIMULATED if name in card["plants"]]
    for card, plant in drawn:
        scores = card["plants"][plant]["all"]
        rows.append(
            (
                card["file"],
                card["sealed"]["date"],
                PLANTS[plant],
                card["look"],
                str(card["scored"]["cases"]),
                card["answered"]["code"][:16],
                *(_in_draw(scores, path) for _, path in DRAW_SCORES),
                "yes" if ALARMS_COUNTED in card.get("rules", ()) else "no",
                _median(scores["amplitude"]["relative_error"]),
            )
        )
    columns = (
        "card",
        "keys sealed",
        "persons",
        "look",
        "cases",
        "code of the answers",
        *(name for name, _ in DRAW_SCORES),
        "alarms and gaps found include answers that abstain",
        "amplitude error, median",
    )
    return Table(columns, rows)


def _in_draw(scores: Mapping[str, Any], path: Sequence[str]) -> str:
    """A rate of a draw; the first draws had fewer scores."""
    return "not scored then" if path[0] not in scores else _rate(_at(scores, path))


def score_tables(scores: Mapping[str, Any]) -> dict[str, Table]:
    """Score cards of blind cases by what a plant is, all modes beside each other."""
    return {PLANTS[plant]: _score_table(_with_held(scores, plant)) for plant in scores["plants"]}


def together_table(cards: Sequence[Mapping[str, Any]], plant: str = "P1") -> Table:
    """Rates over all draws that were scored by the rules of the latest, all modes side by side.

    One draw of 60 holds some ten cases of a kind, which hardly tell a rate.

    Parameters
    ----------
    cards : score cards, the latest last; plant : persons that are counted

    Returns
    -------
    table : without rows where there is one such draw, whose rates are its own
    """
    rules = cards[-1].get("rules") if cards else None
    alike = [
        _with_held(card, plant)
        for card in cards
        if card.get("rules") == rules and plant in card["plants"]
    ]
    modes = list(dict.fromkeys(mode for scores in alike for mode in scores))
    rows = [
        (
            text,
            *(
                _in_mode(m, path, _rate(_together(_at(one.get(m), path) for one in alike)))
                for m in modes
            ),
            bar,
        )
        for text, path, bar in SCORES
        if len(alike) > 1
    ]
    return Table((f"{len(alike)} draws", *modes, "bar"), rows)


def _with_held(card: Mapping[str, Any], plant: str) -> dict[str, dict[str, Any]]:
    """Scores of a plant by mode, with how often 90 % sets hold the truth by kind of case."""
    rows = [row for row in card.get("cases", ()) if row["plant"] == plant]
    # Of pairs, and where there is no answer, nothing is covered or not.
    rows = [row for row in rows if row["covered"] is not None]
    found = {}
    for mode, scores in card["plants"][plant].items():
        own = [row for row in rows if mode in ("all", row["mode"], f"who {row.get('person')}")]
        kinds: dict[str, list[bool]] = {SINGLES: [], OTHERS: []}
        for row in own:
            kinds[SINGLES if row["status"] == "single" else OTHERS].append(row["covered"])
        held = {kind: _share(sum(hits), len(hits)) for kind, hits in kinds.items()}
        found[mode] = {**scores, HELD: held}
    return found


def _together(rates: Iterable[Mapping[str, Any] | None]) -> dict[str, Any]:
    """One rate of the cases of several."""
    known = [rate for rate in rates if rate is not None]
    return _share(*(sum(rate[key] for rate in known) for key in ("hits", "n")))


def _share(hits: int, cases: int) -> dict[str, Any]:
    """A rate as score cards have it."""
    if not cases:
        return {"value": None, "hits": 0, "n": 0}
    return {"value": hits / cases, "hits": hits, "n": cases, "wilson95": wilson95(hits, cases)}


def _score_table(modes: Mapping[str, Any]) -> Table:
    names = list(modes)
    rows = [("cases", *(str(sum(modes[m]["cases"].values())) for m in names), "")]
    for text, path, target in SCORES:
        rows.append((text, *(_in_mode(m, path, _in_draw(modes[m], path)) for m in names), target))
    for text, path, target in MEDIANS:
        digits = ".0f" if path == ("seconds",) else ".2g"
        rows.append((text, *(_median(_at(modes[m], path), digits) for m in names), target))
    for text, path, target in NUMBERS:
        rows.append((text, *(_number(_at(modes[m], path)) for m in names), target))
    return Table(("", *names, "bar"), rows)


def _at(scores: Mapping[str, Any] | None, path: Sequence[str]) -> Any:
    found: Any = scores
    for key in path:
        found = found.get(key) if found else None
    return found


def _in_mode(mode: str, path: Sequence[str], said: str) -> str:
    """A rate, in words, in the column of a mode."""
    return said if mode == "all" or path[0] != OF_ALL else "see all"


def _rate(rate: Mapping[str, Any] | None) -> str:
    if rate is None or rate["value"] is None:
        return "no case"
    low, high = rate["wilson95"]
    return f"{percent(rate['value'])} [{percent(low)}, {percent(high)}], {rate['n']} cases"


def _median(spread: Mapping[str, Any] | None, digits: str = ".2g") -> str:
    if spread is None or spread["median"] is None:
        return "no case"
    return f"{spread['median']:{digits}} ({spread['n']} cases)"


def _number(value: float | None) -> str:
    return "no case" if value is None else f"{value:.2g}"


def _undecided(diagnosis: Mapping[str, Any]) -> bool:
    return diagnosis["status"] != "ok"


def _gap(diagnosis: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Is there a gap, its p value, the test that says so, and its size beyond the noise."""
    gap = diagnosis["gap"]
    if gap is None:
        return f"no verdict: {diagnosis['status_reason']}", "", "", ""
    size, interval = gap["size"]["value"], gap["size"]["ci95"]
    ends = "" if interval is None else f" [{interval[0]:.2g}, {interval[1]:.2g}]"
    test = TESTS.get(gap["statistic"], gap["statistic"])
    return "yes" if gap["present"] else "no", f"{gap['p_value']:.2g}", test, f"{size:.2g}{ends}"


def _place(regions: Sequence[Mapping[str, Any]], name: str) -> str:
    largest = sorted(regions, key=lambda region: -region["share"])[:2]
    texts = (
        f"{region[name]} at {region['phase_percent'][0]:.0f} to {region['phase_percent'][1]:.0f} %"
        for region in largest
    )
    return ", ".join(texts) or "nowhere above the threshold"


def _cause(diagnosis: Mapping[str, Any]) -> str:
    if diagnosis["status"] == "abstained":
        return f"not decided: {diagnosis['status_reason']}"
    gap, candidates = diagnosis["gap"], diagnosis["candidates"]
    if gap is None or not gap["present"] or not candidates:
        return "none asked for"
    best = candidates[0]
    if diagnosis["none_p"] > best["p"]:
        return "none of the known effects"
    sizes = "; ".join(_amplitude(p) for p in best["parameters"])
    return f"{best['label']} (probability {percent(best['p'])}): {sizes}"


def _amplitude(parameter: Mapping[str, Any]) -> str:
    unit = "" if parameter["unit"] == "1" else f" {parameter['unit']}"
    interval = parameter["ci95"]
    ends = "" if interval is None else f" [{interval[0]:.3g}, {interval[1]:.3g}]"
    bound = ", on its bound" if parameter["at_bound"] else ""
    return f"{parameter['name']} {parameter['value']:.3g}{unit}{ends}{bound}"


def _shrinkage(diagnosis: Mapping[str, Any]) -> str:
    found = diagnosis["shrinkage"]
    if found is None:
        return "not asked for"
    # Of other trials than the fitted ones there are none: their share follows from the fit.
    parts = [
        f"{text}: {_removed(found[key])}"
        for key, text in (
            ("in_sample", "in sample"),
            ("new_task", "expected on a new movement, not measured"),
        )
    ]
    if diagnosis["status"] == "abstained":
        parts.append("by the most probable cause, which is not named")
    return "; ".join(parts)


def _removed(share: Mapping[str, Any] | None) -> str:
    if share is None:
        return "none to remove"
    interval = share["ci95"]
    ends = "" if interval is None else f" [{', '.join(map(percent, interval))}]"
    return percent(share["value"]) + ends
