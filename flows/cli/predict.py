"""The command that predicts motions with a study's policy."""

from __future__ import annotations

import sys
from collections import Counter
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plancurate.errors import PlancurateError
from plancurate.flows.cli.console import console, output, table, write
from plancurate.flows.cli.network_options import NetworkOptions
from plancurate.flows.cli.options import HomeOptions
from plancurate.flows.cli.verify import payload_of

if TYPE_CHECKING:
    from plancurate.tasks.motion.predict import Prediction

NOT_ALL = 1


def predict(
    *,
    network: NetworkOptions,
    target: tuple[float, float, float] | None = None,
    targets: Path | None = None,
    planner_alone: bool = False,
    proposals: int = 4,
    payload_mass: float | None = None,
    payload_centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
    out: Path | None = None,
    json: bool = False,
    options: HomeOptions = HomeOptions(),
) -> None:
    """Make a verified motion to a target with a study's policy, or the planner where the policy's does not pass.

    Exit code 0 when every target got a motion, else 1.

    Args:
        target: Position for the tool in the robot's frame, m.
        targets: CSV file with columns x, y and z for many targets at once.
        planner_alone: Ask the planner only, for comparison.
        proposals: Motions that a mixture policy may propose.
        payload_mass: Mass that the tool carries, kg.
        payload_centre: Its centre in the tool's frame, m.
        out: File for the motion, as `verify` reads it; of many targets, each is numbered before the ending.
        json: Print everything but the samples as JSON.
    """
    if (target is None) == (targets is None):
        raise PlancurateError("predict: --target X Y Z or --targets FILE is needed, not both")
    payload = payload_of(payload_mass, payload_centre)
    from plancurate.tasks.motion.predict import predict_motions  # torch and SciPy: no --help needs them
    from plancurate.tasks.motion.target_files import read_targets, write_prediction, write_predictions
    from plancurate.tasks.motion.trajectory_files import format_of
    from plancurate.tasks.study.predictor import study_policy

    positions = np.array([target]) if target else read_targets(targets or Path())
    if out:
        format_of(out)
    chosen = study_policy(options.folder(), network.choice())
    settings = chosen.settings.model_copy(update={"proposals": proposals})
    trained = None if planner_alone else chosen.trained
    found = predict_motions(trained, chosen.robot, chosen.scene, positions, settings, payload)
    if out and target:
        write_prediction(out, found[0])
    elif out:
        write_predictions(out, found)
    who = {"selector": chosen.row.name, "policy": chosen.row.policy, "seed": chosen.row.seed}
    if json:
        write(dumps({**who, "predictions": [one.as_record() for one in found]}, indent=1))
    else:
        show(" ".join(map(str, ("policy:", chosen.row.policy, "on", chosen.row.name))), found)
    sys.exit(0 if all(one.motion for one in found) else NOT_ALL)


def show(title: str, found: list[Prediction]) -> None:
    """Print who made which motion and how long it took, for a person."""
    console.print(title, highlight=False)
    shown = table("target (m)", "made by", "takes", "off", "made in (ms)")
    for one in found:
        duration = f"{one.motion.times[-1]:.2f} s" if one.motion else ""
        off = "" if one.distance_m is None else f"{1000 * one.distance_m:.1f} mm"
        spent = ", ".join(
            f"{stage} {1000 * seconds:.0f}" for stage, seconds in one.seconds.items() if seconds
        )
        shown.add_row(" ".join(f"{x:.3f}" for x in one.target), one.made_by, duration, off, spent)
    output.print(shown)
    if len(found) == 1:
        for reason in found[0].refused:
            output.print(f"refused: {reason}", style="dim", markup=False, highlight=False, soft_wrap=True)
    else:
        counts = Counter(one.made_by for one in found)
        output.print(
            ", ".join(f"{count} by {maker}" for maker, count in counts.most_common()), highlight=False
        )
