"""Keys of the benchmarks, which are no part of the study: blind cases and the solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scapulohumeral.configuration.fields import FolderName, Once, Real, Section, Seed, Whole, key


@dataclass(frozen=True)
class BlindCases(Section):
    """Number of cases by benchmark."""

    blind: Annotated[Whole, key("Large benchmark [1].", ge=1, le=1000)]
    blind_small: Annotated[Whole, key("Small benchmark [1].", ge=1, le=1000)]
    blind_opensim: Annotated[Whole, key("Persons simulated by OpenSim [1].", ge=1, le=1000)]
    open: Annotated[Whole, key("Open cases to calibrate with [1].", ge=1, le=1000)]


@dataclass(frozen=True)
class BlindBenchmark(Section):
    """Blind benchmark of the gap diagnosis, ``config/gap/blind.yaml``."""

    keys: Annotated[
        str, key("Folder of the sealed keys, outside the checkout [no unit].", min_length=1)
    ]
    participants: Annotated[
        list[FolderName],
        key("Whose anatomy and recordings the cases are made from [no unit].", min_length=1),
        Once,
    ]
    cases: Annotated[BlindCases, key("Number of cases by benchmark.")]
    nulls: Annotated[Whole, key("Effect-free cases of the null bank [1].", ge=1, le=1000)]
    nulls_seed: Annotated[Seed, key("Seed of the effect-free cases [1].")]
    open_seed: Annotated[Seed, key("Seed of the open cases [1].")]
    probes: Annotated[Whole, key("Cases that are tested again to check the bank [1].", ge=1, le=20)]


@dataclass(frozen=True)
class SolverBenchmark(Section):
    """Benchmark of the solver, ``config/bench.yaml``."""

    opty_muscles: Annotated[
        list[Annotated[Whole, key("Number of muscles [1].", ge=1, le=126)]],
        key("Muscles in the models that plain opty builds [1].", min_length=1),
        Once,
    ]
    peer_limit_s: Annotated[
        Real, key("Time that a peer gets for building or solving [s].", gt=0, le=36000)
    ]
