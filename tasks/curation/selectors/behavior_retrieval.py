"""Behavior Retrieval: what resembles a few demonstrations of the task is worth training on.

Du, Nair, Sadigh, Finn: Behavior Retrieval: Few-Shot Imitation Learning by Querying Unlabeled Datasets, RSS 2023.
Each target is a task. Its task demonstrations are drawn from the candidates that lead there, for nothing else
is known to be good; its other candidates are ranked by how near, in the latent space of an autoencoder of
(state, action), each of their steps is to the nearest step of a task demonstration. The state holds the way to
the target: all motions start alike, so without it those to other targets would be retrieved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from pydantic import Field

from plancurate.tasks.curation.pool import FloatArray
from plancurate.tasks.curation.selectors.base import IntArray, Kept, Problem, Settings, selector
from plancurate.tasks.curation.selectors.ranking import Scope, lowest_of_scope, random_draws, tie_draws
from plancurate.tasks.curation.selectors.transitions import (
    Transitions,
    load_transitions,
    standardised,
    target_rows,
)
from plancurate.tasks.curation.selectors.vae import train_autoencoder
from plancurate.tasks.curation.selectors.windows import Mask, kept_waypoints, window_counts
from plancurate.tasks.learning.demonstrations import Float32Array

_BLOCK = 4096  # rows of a table of distances


class BehaviorRetrievalSettings(Settings):
    """Task demonstrations and autoencoder."""

    task_demos: int = Field(5, ge=1, description="task demonstrations a target, at most half its candidates")
    task: Literal["random", "shortest"] = Field(
        "random", description="which they are; 'shortest' is told what a good path is, and so privileged"
    )
    vae_steps: int = Field(300, ge=1, description="gradient steps of the autoencoder")


class NativeSettings(BehaviorRetrievalSettings):
    """How many single steps are retrieved."""

    kept_share: float = Field(0.25, gt=0, le=1, description="share of each target's steps, the nearest")
    delta: float | None = Field(
        None,
        ge=0,
        le=1,
        description="in place of a share: least similarity, scaled to 0 (the farthest step) to 1 (the nearest)",
    )


@dataclass(frozen=True, eq=False)
class Retrieval:
    """A queried pool."""

    transitions: Transitions
    target: IntArray
    """(candidates,): row of each candidate's target."""
    place: IntArray
    """(candidates,): place among the target's task demonstrations from 0 on, -1 for the other candidates."""
    distance: FloatArray
    """(steps,): to the nearest step of a task demonstration of the same target; 0 for their own steps."""


@selector("BehaviorRetrieval", BehaviorRetrievalSettings, revision=2)
def behavior_retrieval(problem: Problem, settings: BehaviorRetrievalSettings) -> Kept:
    """Keep k/4 random task demonstrations of each target and its candidates that resemble them most.

    Of m task demonstrations min(m, k // 4) are kept, none for k < 4: there the query alone is theirs. The
    others are out of the ranking and are kept last, where a target has nothing else. The score is the mean
    distance of a trajectory's steps; 0 for task demonstrations, which are not ranked.
    """
    return _nearest_trajectories(problem, settings, "target")


@selector("BehaviorRetrieval_Global", BehaviorRetrievalSettings, revision=2)
def behavior_retrieval_global(problem: Problem, settings: BehaviorRetrievalSettings) -> Kept:
    """Keep k/4 random task demonstrations of each target and the pool's candidates nearest to their own target's."""
    return _nearest_trajectories(problem, settings, "pool")


@selector("BehaviorRetrieval_Native", NativeSettings, budgeted=False, revision=2)
def behavior_retrieval_native(problem: Problem, settings: NativeSettings) -> Kept:
    """Keep the steps nearest to random task demonstrations and, drawn as often, those demonstrations.

    Whatever is retrieved only says where training windows begin; their contents come from whole trajectories.
    """
    found = retrieve(problem, settings)
    with problem.stage("select"):
        return native_windows(found, settings)


def _nearest_trajectories(problem: Problem, settings: BehaviorRetrievalSettings, scope: Scope) -> Kept:
    found = retrieve(problem, settings)
    with problem.stage("score"):
        score = found.transitions.mean(found.distance)
        demo_key = np.where(found.place < problem.budget // 4, -1.0, np.inf)
        key = np.where(found.place >= 0, demo_key, score)
    kept = lowest_of_scope(problem, key, scope)
    return replace(kept, score=score[kept.rows])


def retrieve(problem: Problem, settings: BehaviorRetrievalSettings) -> Retrieval:
    """Draw the task demonstrations, embed all steps and measure how far they are from them."""
    with problem.stage("prepare"):
        transitions = load_transitions(problem)
        target = target_rows(problem)
    place = task_places(problem, settings, target)
    embedding = embedded(problem, settings, transitions)
    with problem.stage("score"):
        distance = task_distances(embedding, target[transitions.candidate], place[transitions.candidate] >= 0)
    return Retrieval(transitions, target, place, distance)


def embedded(problem: Problem, settings: BehaviorRetrievalSettings, transitions: Transitions) -> Float32Array:
    """Each step (steps, e): what an autoencoder, trained on all of them, makes of it, and its standardised action."""
    with problem.stage("prepare"):
        rows = standardised(np.concatenate([transitions.observations, transitions.actions], axis=1))
    with problem.stage("base_policy"):
        rng = torch.Generator().manual_seed(problem.seed)
        vae = train_autoencoder(rows, 2 * problem.robot.dof, settings.vae_steps, rng)
    with problem.stage("score"):
        actions = rows[:, transitions.observations.shape[1] :]
        return np.concatenate([vae.means(rows), actions], axis=1)


def task_places(problem: Problem, settings: BehaviorRetrievalSettings, target: IntArray) -> IntArray:
    """Choose each target's task demonstrations: their places (candidates,) from 0 on, -1 for other candidates."""
    if settings.task == "shortest":
        key: FloatArray = problem.pool.candidates["path_length"].to_numpy()
    else:
        key = random_draws(problem, "BehaviorRetrieval")
    tie = tie_draws(problem)
    place = np.full(len(target), -1)
    with problem.stage("select"):
        for number in np.unique(target):
            rows = np.flatnonzero(target == number)
            count = min(settings.task_demos, max(1, len(rows) // 2))
            place[rows[np.lexsort((tie[rows], key[rows]))[:count]]] = np.arange(count)
    return place


def task_distances(embedding: Float32Array, target: IntArray, of_task: Mask) -> FloatArray:
    """Distance of each step to the nearest task step of its target, 0 for task steps.

    `embedding` is (steps, e), `target` (steps,), `of_task` (steps,) says which steps are of task demonstrations;
    those are no one's result, so that nothing is near for being itself.
    """
    distance = np.zeros(len(embedding))
    for number in np.unique(target):
        here = target == number
        ranked = np.flatnonzero(here & ~of_task)
        distance[ranked] = nearest(embedding[ranked], embedding[here & of_task])
    return distance


def nearest(points: Float32Array, references: Float32Array) -> FloatArray:
    """Euclidean distance of points (p, e) to the nearest of references (r, e); all are compared."""
    squares = (references**2).sum(axis=1)
    found = np.empty(len(points))
    for begin in range(0, len(points), _BLOCK):
        block = points[begin : begin + _BLOCK]
        closest = (squares - 2 * (block @ references.T)).argmin(axis=1)
        # By the difference itself, since that of squares makes copies differ.
        found[begin : begin + _BLOCK] = np.linalg.norm(block - references[closest], axis=1)
    return found


def near_enough(distance: FloatArray, settings: NativeSettings) -> Mask:
    """Which of a target's steps (steps,) are retrieved.

    `delta` is the method's own measure. What it keeps depends on the farthest step of all, which a share
    does not.
    """
    if settings.delta is None:
        count = int(np.ceil(settings.kept_share * len(distance)))
        return np.asarray(distance <= np.partition(distance, count - 1)[count - 1])
    span = distance.max() - distance.min()
    similarity = (distance.max() - distance) / span if span > 0 else np.ones_like(distance)
    return np.asarray(similarity >= settings.delta)


def native_windows(found: Retrieval, settings: NativeSettings) -> Kept:
    """Retrieved steps and whole task demonstrations, weighted so that windows of both are drawn equally often."""
    candidate = found.transitions.candidate
    retrieved = np.zeros(len(candidate), dtype=bool)
    ranked = found.place[candidate] < 0
    weight = np.ones(len(found.place))
    for number in np.unique(found.target[candidate[ranked]]):
        rows = np.flatnonzero(ranked & (found.target[candidate] == number))
        retrieved[rows] = near_enough(found.distance[rows], settings)
    windows = window_counts(found.transitions, retrieved | ~ranked)
    for number in np.unique(found.target):
        demos = (found.target == number) & (found.place >= 0)
        others = (found.target == number) & (found.place < 0)
        if windows[others].any():
            weight[demos] = windows[others].sum() / windows[demos].sum()
    rows = np.flatnonzero(windows)
    whole = found.place >= 0
    steps = kept_waypoints(found.transitions, retrieved)
    return Kept(rows, steps=[None if whole[row] else steps[row] for row in rows], weight=weight[rows])
