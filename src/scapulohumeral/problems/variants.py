"""Variants: named sets of choices of model and problem, and the ladder between two of them.

A variant holds only what differs from the study's own model and problem. The ladder leads from one
variant to the study by taking its differences back: one alone, or all up to one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scapulohumeral.errors import ConfigError

STUDY = "study"
# What of a model the muscle paths depend on.
PATH_CHOICES = ("serratus_path", "paths")


@dataclass(frozen=True)
class Variant:
    """What differs from the study's own: `model` and `problem` choices by key.

    `neighbour` is the variant whose solutions those of this one start from, if any.
    """

    name: str
    model: Mapping[str, str]
    problem: Mapping[str, Any]
    neighbour: str | None = None

    def without(self, name: str, keys: Sequence[str]) -> Variant:
        """The variant of another name whose choices of some keys are the study's.

        It starts from this one, unless the arm that is followed is another.
        """
        return Variant(
            name,
            {key: value for key, value in self.model.items() if key not in keys},
            {key: value for key, value in self.problem.items() if key not in keys},
            None if "arm" in keys else self.name,
        )


def named_variants(section: Mapping[str, Any]) -> dict[str, Variant]:
    """Variants of the section ``variants`` of the configuration, the study among them, by name.

    Raises
    ------
    ConfigError                      a ladder that starts nowhere or takes back what is not there
    """
    found = {STUDY: Variant(STUDY, {}, {})}
    for name, choices in section["named"].items():
        found[name] = Variant(name, choices["model"], choices["problem"])
    return found | ladder(found, section["ladder"])


def ladder(named: Mapping[str, Variant], settings: Mapping[str, Any]) -> dict[str, Variant]:
    """Rungs between a variant and the study: ``upto_<step>`` in order, some ``alone_<step>``.

    The last ``upto`` is the study on the first variant's arm unless the arm is a step, too. The
    first step needs no rung of its own alone. Each rung starts from the one that it differs from by
    one step, so that a step leads to another optimum only if it does so from there, and not because
    the start was another.

    Raises
    ------
    ConfigError                      a start that is no variant, or ``alone`` of no step
    """
    start = settings["start"]
    if start not in named:
        raise ConfigError(
            f"Config key 'variants.ladder.start' is '{start}'. Write one of: {', '.join(named)}"
        )
    strange = [step for step in settings["alone"] if step not in settings["steps"]]
    if strange:
        raise ConfigError(
            f"Config key 'variants.ladder.alone' names {', '.join(strange)}. Write steps of the "
            f"ladder: {', '.join(settings['steps'])}"
        )
    rungs: dict[str, Variant] = {}
    before = named[start]
    for step, keys in settings["steps"].items():
        unknown = [key for key in keys if key not in {**named[start].model, **named[start].problem}]
        if unknown:
            raise ConfigError(
                f"Config key 'variants.ladder.steps.{step}' takes back {', '.join(unknown)}, in "
                f"which '{start}' does not differ from the study. It differs in: "
                f"{', '.join([*named[start].model, *named[start].problem])}"
            )
        if step in settings["alone"]:
            rungs[f"alone_{step}"] = named[start].without(f"alone_{step}", keys)
        before = before.without(f"upto_{step}", keys)
        rungs[f"upto_{step}"] = before
    return rungs


def model_name(configured: Mapping[str, str], changes: Mapping[str, str]) -> str | None:
    """Name of a model by its choices, or None where it is the configured one."""
    chosen = {**configured, **changes}
    return None if chosen == dict(configured) else "-".join(chosen[key] for key in configured)


def choices_of(configured: Mapping[str, str], name: str) -> dict[str, str]:
    """Choices of a model by its name, the reverse of :func:`model_name`."""
    return dict(zip(configured, name.split("-"), strict=True))


def geometry_name(configured: Mapping[str, str], variant: Variant) -> str | None:
    """Name of the model whose muscle paths a variant has: the study's, but for its paths.

    None where the paths are the study's own; on the published arm they never are, because that arm
    goes where the recorded one does not.
    """
    changes = {key: variant.model[key] for key in PATH_CHOICES if key in variant.model}
    name = model_name(configured, changes)
    if name is None and variant.problem.get("arm") == "published":
        return "-".join(configured.values())
    return name


def predicted(
    section: Mapping[str, Any], participants: Sequence[str]
) -> list[tuple[str, str, str]]:
    """Variant, participant and condition of all configured predictions of variants.

    Parameters
    ----------
    section : ``variants`` of the configuration
    participants : those of the study; others are left out
    """
    return [
        (variant, participant, condition)
        for variant, people in section["predict"].items()
        for participant, conditions in people.items()
        if participant in participants
        for condition in conditions
    ]
