"""Building the null bank from effect-free cases, as folders like those of the blind benchmark.

Cases of one person share a model, so that it is built once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from scapulohumeral.errors import DataError
from scapulohumeral.gap.assembly import assemble
from scapulohumeral.gap.benchmark.protocol import folder_request
from scapulohumeral.gap.detection.null_bank import NullCase, Probe, write_bank
from scapulohumeral.gap.detection.presence import tested
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.nominal.participant_model import (
    ModelSettings,
    ParticipantModel,
    participant_model,
)
from scapulohumeral.gap.recording.case import Case, make_case
from scapulohumeral.gap.recording.observables import channel_names
from scapulohumeral.gap.residual.differences import read_records
from scapulohumeral.gap.run import read_case
from scapulohumeral.gap.settings import GapSettings, read_settings


@dataclass(frozen=True)
class BankRequest:
    """What a bank is built from.

    Attributes
    ----------
    cases : folders of effect-free cases; probes : folder of those that are tested one by one
    config, cache : configuration and cache of models; out : file to write
    """

    cases: tuple[Path, ...]
    probes: Path
    config: Path
    cache: Path
    out: Path


def build_bank(request: BankRequest, config: Mapping[str, Any]) -> int:
    """Test all cases, and the probes, with and without reference, EMG and joint force.

    Returns
    -------
    int                              number of rows of the bank, without probes

    Raises
    ------
    DataError                        no cases
    """
    settings = read_settings(config)
    cases = [
        read_case(folder_request(folder, request.config, request.cache), config)
        for several in request.cases
        for folder in sorted(several.iterdir())
        if folder.is_dir()
    ]
    if not cases:
        folders = ", ".join(map(str, request.cases))
        raise DataError(f"{folders}: no case folders; draw cases without effects first.")
    groups: dict[str, list[Case]] = {}
    for case in cases:
        who = case.participant
        groups.setdefault(repr((who.model, who.gravity_mps2)), []).append(case)
    rows: list[NullCase] = []
    for group in groups.values():
        model = _shared_model(group, request.cache, config)
        for case in group:
            rows += _all_rows(case, model, settings)
            # After every case: building takes an hour, and what there is can be used.
            write_bank(request.out, rows, settings)
            print(f"{len(rows)} rows", flush=True)
    vouching = list(probes(request.probes, request.config, request.cache, config))
    write_bank(request.out, rows, settings, vouching)
    return len(rows)


def probes(folder: Path, file: Path, cache: Path, config: Mapping[str, Any]) -> Iterator[Probe]:
    """Probes of all cases in a folder, one after the other."""
    for case in sorted(folder.iterdir()):
        if case.is_dir():
            yield probe(case, file, cache, config)


def probe(folder: Path, file: Path, cache: Path, config: Mapping[str, Any]) -> Probe:
    """Rows of one effect-free case that has a model of its own.

    Parameters
    ----------
    folder : of the case; its name is that of the probe
    file, cache : configuration file and cache of models; config : content of the file
    """
    case = read_case(folder_request(folder, file, cache), config)
    model = _shared_model([case], cache, config)
    return Probe(folder.name, tuple(_all_rows(case, model, read_settings(config))))


def _all_rows(case: Case, model: ParticipantModel, settings: GapSettings) -> list[NullCase]:
    variants = [case, replace(case, reference=())] if case.reference else [case]
    return [row for variant in variants for row in null_cases(variant, model, settings)]


def null_cases(case: Case, model: ParticipantModel, settings: GapSettings) -> list[NullCase]:
    """Rows of one effect-free case: as it is, and without its EMG, its joint force, or both."""
    records = read_records(case, model, settings, [])
    evidence = assemble(case, records, model, settings, [])
    emg = (True, False) if case.channels else (False,)
    contact = (True, False) if case.has_contact else (False,)
    return [_row(evidence, *kind, case, settings) for kind in product(emg, contact)]


def _row(
    evidence: Evidence, emg: bool, contact: bool, case: Case, settings: GapSettings
) -> NullCase:
    """All test values over their thresholds, with or without EMG and joint force."""
    whole = evidence.cautious
    channels = channel_names(case.channels if emg else (), contact)
    rows, part = whole.channel_rows(channels), whole.only(channels)
    shapes = {name: [slope[rows] for slope in slopes] for name, slopes in evidence.shapes().items()}
    found, tests = tested(part, shapes, settings.alpha, 1.0, case.seed)
    over = {one.statistic: round(one.value / one.threshold, 4) for one in tests}
    return NullCase(case.mode, emg, contact, **over)


def _shared_model(
    cases: Sequence[Case], cache: Path, config: Mapping[str, Any]
) -> ParticipantModel:
    trials = [trial for case in cases for trial in (*case.test, *case.reference)]
    union = make_case(cases[0].participant, trials, [])
    return participant_model(union, ModelSettings.of(config), cache)
