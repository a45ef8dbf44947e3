"""Demo-SCORE: what looks like a trained policy's successful rollouts is worth training on.

Chen, Lessing, Liu, Finn: Curating Demonstrations using Online Experience, RSS 2025. Policies are trained on the whole
pool, each for longer than the one before, and rolled out. For each a small classifier learns whether a state is of a
rollout that succeeds; the one that does best on the other policies' rollouts says of each demonstration how like
success its states are in the mean.

Here the policies are trainings of their own, for equal parts of the study's steps up to all of them, where the
authors take checkpoints of one: a checkpoint has a learning rate that has not come down. Successes and failures
weigh alike in the loss, for the share of either differs between pools far more than between their tasks.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from pydantic import Field

from plancurate.tasks.curation.learning_settings import Used
from plancurate.tasks.curation.selectors.base import Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.ranking import highest_of_all, highest_of_scope
from plancurate.tasks.curation.selectors.sampled_policy import (
    Rollouts,
    SampledPolicy,
    Steps,
    base_policy,
    network_of,
    pool_demonstrations,
    roll_out,
    standardised_steps,
)
from plancurate.tasks.curation.selectors.success_classifier import Classifier, Labelled, fit
from plancurate.tasks.learning.demonstrations import Demonstrations, FloatArray

USES: tuple[Used, ...] = ("training", "evaluation", "timing")


class DemoScoreSettings(Settings):
    """Policies, rollouts and classifiers."""

    policies: int = Field(4, ge=2, description="policies, each trained for longer than the one before")
    steps: int | None = Field(
        None, ge=1, description="gradient steps of the last policy; by default those of the study"
    )
    rollouts: int = Field(20, ge=1, description="rollouts of each policy to each target")
    classifier_steps: int = Field(2000, ge=1, description="gradient steps of a classifier")


@selector("DemoSCORE", DemoScoreSettings, uses=USES, revision=2)
def demo_score(problem: Problem, settings: DemoScoreSettings) -> Kept:
    """Keep the k trajectories of each target that look most like a policy's successful rollouts."""
    score, _ = likeness(problem, settings)
    return highest_of_scope(problem, score, "target")


@selector("DemoSCORE_Native", DemoScoreSettings, budgeted=False, uses=USES, revision=2)
def demo_score_native(problem: Problem, settings: DemoScoreSettings) -> Kept:
    """Keep what looks more like success than a policy's rollouts do in the mean."""
    score, threshold = likeness(problem, settings)
    return highest_of_all(problem, score, int((score >= min(threshold, score.max())).sum()))


def likeness(problem: Problem, settings: DemoScoreSettings) -> tuple[FloatArray, float]:
    """Mean chance of success of each candidate's states (candidates,), and that of all rollouts."""
    what = tuple(getattr(settings, name) for name in DemoScoreSettings.model_fields)
    return problem.once(("DemoSCORE", what), lambda: learnt_likeness(problem, settings))


def learnt_likeness(problem: Problem, settings: DemoScoreSettings) -> tuple[FloatArray, float]:
    """Train policies and classifiers for `likeness`.

    Where every policy's rollouts all end alike nothing can be learned from them: a half for all.
    """
    with problem.stage("prepare"):
        data = pool_demonstrations(problem)
    found = [*policies_rollouts(problem, settings, data)]
    shown = [labelled(rollouts) for _, rollouts in found]
    useful = [one for one in shown if not one.one_sided]
    demos = found[-1][0]
    with problem.stage("score"):
        if not useful:
            return np.full(len(demos.starts), 0.5), 0.5
        chosen = best_classifier(useful, settings.classifier_steps, problem.seed)
        chance = chosen.probability(demos.observations)
        of_rollouts = np.concatenate([chosen.probability(one.states) for one in shown])
        return np.add.reduceat(chance, demos.starts) / demos.lengths, float(of_rollouts.mean())


def policies_rollouts(
    problem: Problem, settings: DemoScoreSettings, data: Demonstrations
) -> Iterator[tuple[Steps, Rollouts]]:
    """Train each policy and roll it out: the demonstrations as it sees them, and its rollouts."""
    training = problem.learning.training
    most = settings.steps or training.steps
    for part in range(1, settings.policies + 1):
        steps = max(1, most * part // settings.policies)
        with problem.stage("base_policy"):
            own = training.model_copy(update={"steps": steps})
            trained = base_policy(problem, data, own)
            shown = standardised_steps(data, trained)
            policy = SampledPolicy(network_of(trained), 0.0, trained)  # it acts as it was trained to
        with problem.stage("rollouts"):
            yield shown, roll_out(problem, policy, settings.rollouts)


def labelled(rollouts: Rollouts) -> Labelled:
    """States of rollouts with the outcome of the rollout that each is of."""
    success = (rollouts.returns > 0).astype(np.float32)
    return Labelled(rollouts.steps.observations, np.repeat(success, rollouts.steps.lengths))


def best_classifier(shown: list[Labelled], steps: int, seed: int) -> Classifier:
    """Train a classifier on each policy's rollouts; the one of the least loss on the others' rollouts.

    Of one policy alone, its own rollouts are all there is to judge by.
    """
    rng = torch.Generator().manual_seed(seed)
    fitted = [fit(one, [o for o in shown if o is not one] or [one], steps, rng) for one in shown]
    return min(fitted, key=lambda one: one.held_loss)
