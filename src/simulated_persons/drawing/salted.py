"""Cases of recorded motion with an error of measurement added: nothing is simulated."""

from __future__ import annotations

import numpy as np

from simulated_persons.arm import draw_person
from simulated_persons.case_person import scatter_scales
from simulated_persons.drawing.study import Study
from simulated_persons.drawing.trials import Recordings
from simulated_persons.movement import draw_variation, no_variation, wished_poses
from simulated_persons.observation import electrode_matrix, record
from simulated_persons.plan import Plan


def salted(study: Study, plan: Plan) -> Recordings:
    """Recorded motion with salt: its repeats move otherwise, as those of people do.

    There is one recording per task, so test and reference differ by salt and scatter only, not by
    what a session changes. The scatter is of the size found between repeats; that of clavicle and
    scapula is noise of the record, which is added as for simulated persons.
    """
    rng = np.random.default_rng(plan.seed)
    anatomy = study.anatomies[plan.participant]
    person = draw_person(anatomy, rng)
    affected = person
    for injection in plan.injections:
        affected = injection.apply(affected)
    electrodes = electrode_matrix(anatomy.names, anatomy.groups)
    trials: Recordings = {}
    for task in (*plan.tasks, plan.hidden):
        motion, scale = study.motions[plan.participant, task], scatter_scales(plan)[task]
        for side, arm in (("reference", person), ("test", affected)):
            for repeat in range(plan.repeats + 1 if task != plan.hidden else 1):
                varied = no_variation() if repeat == 0 else draw_variation(rng, scale)
                pose = wished_poses(motion, varied)
                rest = np.zeros((len(pose), len(anatomy.names)))
                free = np.zeros((len(pose), 3))
                trials[side, task, repeat] = record(pose, rest, free, arm.measurement, electrodes)
    return trials
