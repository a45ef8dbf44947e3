"""A tiny pool whose numbers are pinned together with the stage's revision."""

import hashlib

import numpy as np
import pyarrow as pa

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.generate import REVISION, generate_candidates
from plancurate.tasks.candidates.settings import GenerateSettings, PlanSettings, TargetSettings
from plancurate.tasks.candidates.targets import sample_targets

# By revision and OMPL's version, both of which name a pool. Another OMPL needs its own entry here, no new revision.
FROZEN = {(2, "1.5.2"): "43130872933cf8b7"}
MEASURED = {"plan_s", "timing_s", "verify_s"}
ADVICE = (
    "candidates of the same settings have other numbers than before: raise REVISION in "
    "tasks/candidates/generate.py (or sources/ompl.py when only paths differ) and pin the new hash here"
)


def fingerprint(rows: pa.Table) -> str:
    """Hash of the scalar columns, numbers to six digits: the last bits may differ between machines."""
    lines = []
    for row in rows.to_pylist():
        row["trajectory_id"] = row["trajectory_id"].rpartition("-")[
            0
        ]  # without the pool, which names the revision
        scalars = {name: value for name, value in row.items() if name not in MEASURED and name != "q"}
        lines.append(repr({name: rounded(value) for name, value in scalars.items()}))
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def rounded(value):
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return f"{value + 0.0 if abs(value) > 1e-6 else 0.0:.6g}" if isinstance(value, float) else value


def test_results_change_with_the_revision_alone():
    robot, scene, settings = (
        load_robot("h2017"),
        load_scene("free"),
        GenerateSettings(targets=TargetSettings(orientation="exact"), plan=PlanSettings(runs=1, goals="all")),
    )
    targets = sample_targets(robot, scene, settings.targets, 0, 2)
    parts = [
        generate_candidates(robot, scene, targets, name, settings)[0] for name in ("RRTConnect", "KPIECE1")
    ]
    rows = pa.concat_tables(parts)
    assert rows.num_rows == 4
    assert np.all(rows["solved"].to_pylist())
    assert fingerprint(rows) == FROZEN[REVISION, native.ompl_version()], ADVICE
