"""How many motions to unseen targets a study's policy makes itself, and how long each stage takes beside the planner.

Targets are drawn like the study's, with a seed of their own. Every motion that comes back has passed the verifier.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plancurate.tasks.candidates.targets import sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.motion.predict import STAGES, Prediction, predict_motions
from plancurate.tasks.study.predictor import Choice, study_policy

SEED = 7_000_003


def main() -> None:
    """Print a row for each policy of the study and one for the planner alone."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--study", required=True)
    parser.add_argument("--home", type=Path)
    parser.add_argument("--scene")
    parser.add_argument("--selector")
    parser.add_argument("--policies", nargs="+", default=["BC_MLP"])
    parser.add_argument("--targets", type=int, default=500)
    asked = parser.parse_args()
    stages = " | ".join(f"{stage}, ms" for stage in STAGES)
    print(f"| asked | motions | by the policy | {stages} | all, ms | takes, s | off, mm |")
    for policy in [*asked.policies, None]:
        choice = Choice(
            asked.study, scene=asked.scene, selector=asked.selector, policy=policy or asked.policies[0]
        )
        chosen = study_policy(Home.resolve(asked.home), choice)
        settings = chosen.settings.candidates.targets.model_copy(update={"seed": SEED})
        targets = sample_targets(chosen.robot, chosen.scene, settings, 0, asked.targets)
        positions = np.array([target.position for target in targets])
        trained = chosen.trained if policy else None
        predict_motions(
            trained, chosen.robot, chosen.scene, positions[:1], chosen.settings
        )  # imports, caches
        found = predict_motions(trained, chosen.robot, chosen.scene, positions, chosen.settings)
        print_row(f"{policy} on {chosen.row.name}" if policy else chosen.settings.planner, found)


def print_row(name: str, found: Sequence[Prediction]) -> None:
    """Print who made the motions, and medians over them."""
    made = [one for one in found if one.motion is not None]
    makers = Counter(one.made_by for one in made)
    times = [np.median([1000 * one.seconds[stage] for one in made]) for stage in STAGES]
    whole = np.median([1000 * sum(one.seconds.values()) for one in made])
    off = np.median([1000 * (one.distance_m or 0.0) for one in made])
    share = f"{makers['policy']} ({100 * makers['policy'] / len(found):.0f} %)"
    takes = np.median([float(one.motion.times[-1]) for one in made if one.motion is not None])
    shown = " | ".join(f"{value:.1f}" for value in [*times, whole, takes, off])
    print(f"| {name} | {len(made)} of {len(found)} | {share} | {shown} |", flush=True)
    reasons = Counter(
        reason.partition(":")[0] + ":" + reason.partition(":")[2][:40]
        for one in found
        for reason in one.refused
    )
    for reason, count in reasons.most_common(6):
        print(f"    {count} x {reason}", flush=True)


if __name__ == "__main__":
    main()
