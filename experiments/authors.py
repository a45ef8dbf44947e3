"""Three published selectors beside their authors' own code: what both make of the same pool.

    pip install traker
    python experiments/authors.py --behavior-retrieval FOLDER --scizor FOLDER --cupid FOLDER

The folders are clones of MaxDu17/BehaviorRetrieval, UT-Austin-RPL/SCIZOR and agiachris/cupid. Their modules import what
only their own environments have, so single functions are taken out of the files by name. The pool is that of the
preset smoke, 24 candidates to two targets; networks are small, for what is compared is what is made of them.
"""

from __future__ import annotations

import argparse
import ast
import sys
import tempfile
import time
import typing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import duckdb
import numpy as np
import pyarrow as pa
import torch

from plancurate.errors import PlancurateError
from plancurate.tasks.candidates.postprocess_pool import shared_pool
from plancurate.tasks.curation.pool import FloatArray, load_waypoints
from plancurate.tasks.curation.selectors import behavior_retrieval as retrieval
from plancurate.tasks.curation.selectors import cupid, influence, progress, sampled_policy
from plancurate.tasks.curation.selectors.base import Problem, Stopwatch
from plancurate.tasks.curation.selectors.scizor import clocked_steps
from plancurate.tasks.curation.selectors.transitions import load_transitions, target_rows
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.train import train
from plancurate.tasks.study.candidates import make_part, missing_parts, study_targets
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.selections import study_pool

SEED = 0


def main() -> None:
    """Print a line for each comparison."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("behavior-retrieval", "scizor", "cupid"):
        parser.add_argument(f"--{name}", type=Path, required=True, metavar="FOLDER")
    asked = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as home:
        problem = small_problem(Home(Path(home)))
        compare_retrieval(problem, asked.behavior_retrieval)
        compare_progress(problem, asked.scizor)
        compare_influence(problem, asked.cupid)


def authors(file: Path, *names: str) -> SimpleNamespace:
    """Functions and methods of a file by name, with nothing else of it."""
    found = {
        node.name: node
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef) and node.name in names
    }
    space: dict[str, Any] = {"np": np, "torch": torch, **vars(typing)}
    for name in names:
        exec(compile(ast.Module([found[name]], []), str(file), "exec"), space)
    return SimpleNamespace(**{name: space[name] for name in names})


def told(what: str, ours: FloatArray, theirs: FloatArray) -> None:
    """Print how far the same numbers are apart."""
    off = np.abs(ours - theirs).max() / np.abs(theirs).max()
    print(f"{what:60} {len(ours):6d} numbers, at most {off:.1e} of the largest apart")


def small_problem(home: Home) -> Problem:
    """The pool of the preset smoke, planned in that home."""
    study = open_study(load_config("smoke", None, {}), home)
    (pool,) = study.pools
    with shared_pool(study.config.workers):
        for part in missing_parts(study, pool, study_targets(study, pool)):
            make_part(study, part)
    loaded, connection = study_pool(study, pool), duckdb.connect()
    rows = pa.array(np.arange(loaded.candidates.num_rows))
    connection.register("candidates", loaded.candidates.append_column("row", rows))

    def waypoints(ids: typing.Sequence[str]) -> list[FloatArray]:
        return load_waypoints(study.lake, pool.partition, ids)

    watch, learning = Stopwatch(time.perf_counter), pool.learning(study.config)
    return Problem(loaded, 1, SEED, connection, watch, pool.robot, pool.scene, waypoints, learning)


def compare_retrieval(problem: Problem, clone: Path) -> None:
    """Similarity of each step to a target's task demonstrations, scaled to 0 to 1 as the authors do."""
    weigh = authors(clone / "robomimic/robomimic/utils/dataset.py", "reweight_data_from_dataset")
    settings = retrieval.BehaviorRetrievalSettings()
    found = retrieval.retrieve(problem, settings)
    embedding = retrieval.embedded(problem, settings, found.transitions)
    candidate = found.transitions.candidate
    for target in np.unique(found.target).tolist():
        of_task = found.place[candidate] >= 0
        prior, task = ((found.target[candidate] == target) & those for those in (~of_task, of_task))
        theirs = SimpleNamespace(offline_embeddings=embedding[prior])
        weigh.reweight_data_from_dataset(
            theirs, SimpleNamespace(offline_embeddings=embedding[task]), soft=True
        )
        distance = found.distance[prior]
        ours = (distance.max() - distance) / np.ptp(distance)
        told(f"BehaviorRetrieval, target {target}: similarity of steps", ours, theirs._weight_list)


def compare_progress(problem: Problem, clone: Path) -> None:
    """Suboptimality of each step, on the authors' clock of whole steps at 20 a second."""
    code = authors(clone / "curation/video_encoding/suboptimal_hdf5.py", "rank_prob_to_score", "smooth_score")
    clocked = clocked_steps(load_transitions(problem), problem.pool.candidates["dt"].to_numpy())
    clocked = progress.Clocked(
        clocked.states, clocked.starts, clocked.lengths, np.full(len(clocked.lengths), 1 / progress.RATE)
    )
    network = progress.train_classifier(clocked, 300, SEED)
    thresholds = list(zip(progress.EDGES, (*progress.EDGES[1:], 1e4), strict=True))
    they = SimpleNamespace(config={"discriminator": {"rank_thres": thresholds}}, goal_time=[progress.WINDOW])
    window = round(progress.WINDOW * progress.RATE)
    released, completed = [], []
    for row, length in enumerate(clocked.lengths.tolist()):
        ahead = np.minimum(window, length - 1 - np.arange(length))
        times = np.arange(length) / progress.RATE, ahead / progress.RATE
        pairs = progress.pairs_of(clocked, np.full(length, row), *times)
        with torch.no_grad():
            guessed = torch.softmax(network(torch.from_numpy(pairs)), dim=1).numpy()
        raw = code.rank_prob_to_score(
            they, guessed[:, None], ahead[:, None], progress.RATE, progress.DISCOUNT
        )
        released.append(code.smooth_score(they, raw, 1, 0.5))
        raw[0] += progress.DISCOUNT ** (1 / progress.RATE) * raw[1]  # their loop ends one step early
        completed.append(code.smooth_score(they, raw, 1, 0.5))
    ours = progress.suboptimality(clocked, progress.lacks(clocked, network))
    told("SCIZOR: suboptimality of steps, blame reaching the first", ours, np.concatenate(completed))
    means = (per_trajectory(clocked, score) for score in (ours, np.concatenate(released)))
    told("SCIZOR, as released: means of trajectories", *means)


def per_trajectory(clocked: progress.Clocked, score: FloatArray) -> FloatArray:
    """Means over the steps of each trajectory."""
    return np.add.reduceat(score, clocked.starts) / clocked.lengths


def compare_influence(problem: Problem, clone: Path) -> None:
    """Influence of each candidate, by TRAK's scores of pairs of steps and the release's sums over them."""
    from trak.score_computers import BasicScoreComputer

    code = authors(
        clone / "diffusion_policy/common/error_util.py",
        "mean_of_mean_influence", "sum_of_sum_influence",
        "pairwise_sample_to_trajectory_scores", "compute_demo_quality_scores",
    )  # fmt: skip
    data = sampled_policy.pool_demonstrations(problem)
    trained = train("BC_MLP", [data], [SEED], problem.learning.training)[0]
    demos = sampled_policy.standardised_steps(data, trained)
    policy = sampled_policy.sampled_policy(trained, demos)
    rollouts = sampled_policy.roll_out(problem, policy, 10)
    for aggregation, summed in (("mean", code.mean_of_mean_influence), ("sum", code.sum_of_sum_influence)):
        settings = cupid.InfluenceSettings(projection=8, aggregation=aggregation)
        rows = target_rows(problem)
        found = cupid.score(policy, demos, rows, rollouts, problem.pool.n_targets, settings, SEED)
        ours = found["all"].psi
        projections = influence.draw_projections(policy.network, 8, np.random.default_rng(SEED))
        gradients = influence.Gradients(policy.network, projections, settings.output, policy.sigma)
        shown, done = (written_out(gradients, steps) for steps in (demos, rollouts.steps))
        ridge = settings.ridge * float((shown**2).sum()) / shown.shape[1]
        computer = BasicScoreComputer(torch.float64, torch.device("cpu"), lambda_reg=ridge)
        features = computer.get_x_xtx_inv(shown, computer.get_xtx(shown))
        pairs = (features @ done.T).T.numpy()
        success = rollouts.returns > 0
        trajectories = code.pairwise_sample_to_trajectory_scores(
            pairs, len(success), len(ours), indices(rollouts.steps), indices(demos),
            rollouts.steps.lengths, demos.lengths, success, summed, np.float64,
        )  # fmt: skip
        theirs = code.compute_demo_quality_scores(trajectories, success)
        scale = np.linalg.norm(ours) / np.linalg.norm(
            theirs
        )  # TRAK divides by a mean, and adds where we average
        told(f"CUPID, {aggregation} over steps: influence of candidates", ours, scale * theirs)


def written_out(gradients: influence.Gradients, steps: sampled_policy.Steps) -> torch.Tensor:
    """Projected gradients (steps, d) of all layers."""
    factors = gradients.factors(steps.observations, steps.actions)
    outer = [(delta[:, :, None] * h[:, None, :]).reshape(len(delta), -1) for delta, h in factors]
    return torch.from_numpy(np.concatenate(outer, axis=1)).double()


def indices(steps: sampled_policy.Steps) -> list[np.ndarray]:
    """Numbers of the steps of each trajectory."""
    return [first + np.arange(length) for first, length in zip(steps.starts, steps.lengths, strict=True)]


if __name__ == "__main__":
    try:
        main()
    except PlancurateError as error:
        sys.exit(f"{error}")
