from __future__ import annotations

import hashlib
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plancurate import native

PLANNERS = [info.name for info in native.planners()]
BUDGET = native.Budget(state_checks=60_000, polls=10_000, seconds=60)
RESOLUTION = 0.02
HOME = np.array([0, 0, np.pi / 2, 0, np.pi / 2, 0])
GOALS = np.array([[0.7, 0.5, 1.2, 0.0, 1.3, 0.7], [-2.4, -0.4, -1.4, 0.0, -1.4, -2.4]])
LIMITS = np.array([3.14, 1.66, 2.36, 3.14, 2.36, 3.14])


def arm(build):
    """A six-joint arm of two metres: shoulder, elbow and a wrist whose axes meet."""
    frames = [((0, 0, 0.34), (0, 0, 0)), ((0, 0, 0), (0, -1, -1)), ((0.85, 0, 0), (0, 0, 1)),
              ((0, -0.73, 0), (1, 0, 0)), ((0, 0, 0), (-1, 0, 0)), ((0, -0.12, 0), (1, 0, 0))]  # fmt: skip
    origins = [build.pose(xyz, Rotation.from_euler("xyz", np.pi / 2 * np.array(rpy))) for xyz, rpy in frames]
    shapes = [
        (1, build.pose((0, 0, 0.12)), (0.12, 0.05, 0)),
        (1, build.pose((0.42, 0, 0.2), Rotation.from_euler("y", np.pi / 2)), (0.08, 0.35, 0)),
        (1, build.pose((0, 0, -0.3)), (0.07, 0.25, 0)),
        (0, build.pose(), (0.07, 0, 0)),
        (1, build.pose((0, 0, -0.05)), (0.05, 0.04, 0)),
    ]
    arrays = build.robot_arrays(
        joints=[(origin, (0, 0, 1), False) for origin in origins],
        shapes=shapes, frames=[0, 2, 4, 5, 6], pairs=[(0, 2), (0, 3), (0, 4)], scene_shapes=[1, 2, 3, 4],
    )  # fmt: skip
    return native.Robot(**arrays | {"lower": -LIMITS, "upper": LIMITS})


@pytest.fixture(scope="session")
def free(build):
    """The arm above a floor."""
    return SimpleNamespace(robot=arm(build), scene=build.make_scene(ground=0.0, margin=0.005))


@pytest.fixture(scope="session")
def blocked(build):
    """A post and a beam are in every straight way to the goals."""
    post = (2, build.pose((0.85, 0.35, 0.65)), (0.03, 0.65, 0))
    beam = (3, build.pose((-0.1, 0.25, 2.0)), (0.4, 0.1, 0.1))
    scene = build.make_scene([post, beam], ground=0.0, margin=0.005)
    return SimpleNamespace(robot=arm(build), scene=scene)


def solve(world, planner, *, start=HOME, goals=GOALS, seed=1, budget=BUDGET, simplification="full", **params):
    return native.plan(
        world.robot, world.scene, planner, start, goals,
        params=params, seed=seed, budget=budget, resolution=RESOLUTION, simplification=simplification,
    )  # fmt: skip


def fingerprint(result):
    """All of a result but its seconds."""
    counts = (result.status, result.reason, result.termination, result.cost, result.goal_index)
    used = (result.state_checks, result.motion_checks, result.polls)
    return hashlib.sha256(result.path.tobytes() + repr((counts, used)).encode()).hexdigest()


def assert_is_a_solution(world, result):
    assert result.status == "exact"
    assert result.reason == ""
    np.testing.assert_array_equal(result.path[0], HOME)
    np.testing.assert_array_equal(result.path[-1], GOALS[result.goal_index])
    assert native.edge_is_free(world.robot, world.scene, result.path[:-1], result.path[1:], RESOLUTION).all()
    assert (np.abs(result.path) <= LIMITS).all()
    assert result.cost == pytest.approx(np.linalg.norm(np.diff(result.path, axis=0), axis=1).sum())


def test_all_of_the_23_planners_are_there():
    assert len(PLANNERS) == len(set(PLANNERS)) == 23


def test_the_blocked_world_blocks_the_straight_ways_and_nothing_else(blocked):
    starts = np.repeat(HOME[None], len(GOALS), axis=0)
    assert not native.edge_is_free(blocked.robot, blocked.scene, starts, GOALS, RESOLUTION).any()
    assert native.is_free(blocked.robot, blocked.scene, np.vstack([HOME[None], GOALS])).all()


@pytest.mark.parametrize("planner", PLANNERS)
def test_solves_around_obstacles(planner, blocked):
    for seed in range(3):
        assert_is_a_solution(blocked, solve(blocked, planner, seed=seed))


@pytest.mark.parametrize("planner", PLANNERS)
def test_solves_without_obstacles_by_a_straight_line(planner, free):
    result = solve(free, planner)
    assert_is_a_solution(free, result)
    assert len(result.path) == 2


# Ways through OMPL that build generators late, throw states away or sort them.
VARIANTS = [
    ("RRTstar", {"informed_sampling": "1", "ordered_sampling": "1", "ordering_batch_size": "20"}),
    ("RRTstar", {"tree_pruning": "1", "use_k_nearest": "1"}),
    ("STRIDE", {"use_projected_distance": "1"}),
    ("BFMT", {"extended_fmt": "1"}),
    ("SPARS", {"dense_delta_fraction": "0.1", "stretch_factor": "1.1"}),
]
JOBS = [
    (planner, params, seed) for planner, params in [(p, {}) for p in PLANNERS] + VARIANTS for seed in (1, 2)
]


def run_job(world, job):
    planner, params, seed = job
    return fingerprint(solve(world, planner, seed=seed, **params))


@pytest.fixture(scope="module")
def alone(blocked):
    """What every job gives with nothing beside it."""
    return [run_job(blocked, job) for job in JOBS]


@pytest.mark.slow
@pytest.mark.parametrize("threads", [4, 8])
def test_repeats_itself_beside_other_planners_in_other_threads(threads, blocked, alone):
    order = random.Random(threads).sample(range(len(JOBS)), len(JOBS))
    with ThreadPoolExecutor(threads) as pool:
        results = dict(zip(order, pool.map(lambda i: run_job(blocked, JOBS[i]), order), strict=True))
    assert [job for i, job in enumerate(JOBS) if results[i] != alone[i]] == []


def test_all_planners_are_said_to_be_deterministic():
    assert [info.name for info in native.planners() if not info.deterministic] == []
    assert {info.note for info in native.planners()} == {""}


def test_another_seed_gives_another_run(blocked):
    first, second = (solve(blocked, "RRT", seed=seed, simplification="off") for seed in (1, 2))
    assert fingerprint(first) != fingerprint(second)


# A ball that slides along three axes, around a column.
FRESH_PROCESS = """
import hashlib
import numpy as np
from plancurate import native

def shapes(kind, size):
    poses = np.eye(4)[None]
    return dict(shape_kinds=np.array([kind], np.int32), shape_poses=poses, shape_sizes=np.array([size]))

robot = native.Robot(
    origins=np.repeat(np.eye(4)[None], 3, 0), axes=np.eye(3), prismatic=np.ones(3, bool), tool=np.eye(4),
    lower=-np.ones(3), upper=np.ones(3), shape_frames=np.array([3], np.int32),
    pairs=np.zeros((0, 2), np.int32), scene_shapes=np.zeros(1, np.int32), **shapes(0, [0.1, 0, 0]))
scene = native.Scene(ground=None, margin=0, **shapes(2, [0.3, 0.8, 0]))
budget = native.Budget(state_checks=20_000, polls=3_000, seconds=60)
start, goals = np.array([-0.8, 0, 0]), np.array([[0.8, 0, 0], [0, 0.8, 0.1]])
digest = hashlib.sha256()
for info in native.planners():
    result = native.plan(robot, scene, info.name, start, goals,
                         params={}, seed=3, budget=budget, resolution=0.02, simplification="full")
    assert result.status == "exact", info.name
    digest.update(result.path.tobytes())
    digest.update(repr((result.state_checks, result.motion_checks, result.polls)).encode())
print(digest.hexdigest())
"""


def test_fresh_processes_agree_end_cleanly_and_say_nothing_else():
    def run():
        return subprocess.run(
            [sys.executable, "-c", FRESH_PROCESS], capture_output=True, text=True, check=True
        )

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(lambda _: run(), range(2))
    assert first.stdout == second.stdout
    assert len(first.stdout.split()) == 1
    assert first.stderr == second.stderr == ""


def test_a_path_that_is_not_simplified_is_free_as_well(blocked):
    raw, short = (solve(blocked, "KPIECE1", simplification=amount) for amount in ("off", "full"))
    assert_is_a_solution(blocked, raw)
    assert raw.state_checks == short.state_checks
    assert short.cost <= raw.cost


def test_a_partly_simplified_path_lies_between_the_planner_s_and_the_shortest(blocked):
    off, partial, full = (
        [solve(blocked, "RRTConnect", seed=seed, simplification=amount) for seed in range(40)]
        for amount in ("off", "partial", "full")
    )
    for result in partial:
        assert_is_a_solution(blocked, result)
    costs = [np.array([result.cost for result in results]) for results in (off, partial, full)]
    assert (costs[1] <= costs[0] + 1e-9).all()
    assert costs[0].mean() > costs[1].mean() > costs[2].mean()
    assert 0 < (costs[0] == costs[1]).mean() < 0.5  # a drawn number of shortcuts, which may be none
    again = solve(blocked, "RRTConnect", seed=7, simplification="partial")
    assert fingerprint(again) == fingerprint(partial[7])


def test_an_unknown_simplification_is_an_error_that_lists_the_known(free):
    with pytest.raises(ValueError, match="'some' is none of off, partial, full"):
        solve(free, "RRT", simplification="some")


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize(("limit", "most", "beyond"), [("state_checks", 100, 5000), ("polls", 3, 5)])
def test_a_spent_budget_soon_ends_any_planner(planner, limit, most, beyond, blocked):
    budget = native.Budget(**{"state_checks": 10**7, "polls": 10**7, "seconds": 60} | {limit: most})
    result = solve(blocked, planner, budget=budget)
    assert getattr(result, limit) <= most + beyond
    assert result.termination in {limit, "solved", "planner"}
    assert (result.status == "exact") == (result.reason == "")


def test_the_safety_net_ends_what_the_counts_do_not(blocked):
    result = solve(blocked, "RRTstar", budget=native.Budget(state_checks=10**9, polls=10**9, seconds=0.05))
    assert result.termination == "seconds"
    assert 0.05 <= result.seconds < 5


def test_optimizing_planners_stop_at_the_straight_line_and_others_at_any_path(free):
    nearest = np.linalg.norm(GOALS - HOME, axis=1).min()
    for info in native.planners():
        result = solve(free, info.name)
        assert result.termination in ({"solved", "state_checks", "polls"} if info.optimizing else {"solved"})
        assert result.cost >= nearest * (1 - 1e-12)
    assert solve(free, "RRTstar").cost == pytest.approx(nearest)


def test_more_budget_gives_rrtstar_a_path_that_is_no_longer(blocked):
    small, large = (
        solve(
            blocked,
            "RRTstar",
            simplification="off",
            budget=native.Budget(state_checks=n, polls=10**6, seconds=60),
        )
        for n in (20_000, 100_000)
    )
    assert large.cost <= small.cost
    assert small.termination == "state_checks"


def test_a_start_that_cannot_be_used_is_a_result_that_names_it(blocked):
    outside = solve(blocked, "RRT", start=np.array([0, 1.7, 0, 0, 0, 0]))
    assert (outside.status, outside.termination, outside.path.shape) == ("none", "start", (0, 6))
    assert outside.reason == "start: joint 2 = 1.7 is outside its limits -1.66 .. 1.66"
    folded = solve(blocked, "RRT", start=np.array([0, 1.6, 1.6, 0, 0, 0]))
    assert (folded.status, folded.reason) == ("none", "start is in collision")


def test_a_goal_that_cannot_be_used_is_a_result_that_names_it(blocked):
    result = solve(blocked, "PRM", goals=np.vstack([GOALS, np.full(6, np.nan)]))
    assert (result.status, result.termination, result.state_checks) == ("none", "goal", 0)
    assert result.reason.startswith("goal 2: joint 1 = nan is outside its limits")


def test_a_start_that_is_a_goal_is_a_path_of_one_waypoint(free):
    result = solve(free, "SBL", goals=np.vstack([GOALS, HOME]))
    assert (result.status, result.goal_index, result.cost) == ("exact", 2, 0)
    np.testing.assert_array_equal(result.path, HOME[None])


def test_an_unknown_planner_is_an_error_that_lists_all(free):
    with pytest.raises(ValueError, match=r"unknown planner 'RRTX'; there are RRT, RRTstar.*SBL"):
        solve(free, "RRTX")


def test_an_unknown_parameter_is_an_error_that_lists_the_planners_own(free):
    with pytest.raises(
        ValueError, match="RRT has no parameter 'rnge'; it has goal_bias, intermediate_states, r"
    ):
        solve(free, "RRT", rnge="1")
    with pytest.raises(ValueError, match="it has none"):
        solve(free, "PRMstar", range="1")


@pytest.mark.parametrize("value", ["", "far", "1 rad", "nan", "-1", "1e9", "0.001"])
def test_a_parameter_value_that_makes_no_sense_is_an_error(value, free):
    with pytest.raises(ValueError, match=r"RRT.range = '.*' is not a value that it takes; its range is 0"):
        solve(free, "RRT", range=value)


def test_listed_parameters_are_what_is_used_when_none_is_given(blocked):
    for info in native.planners():
        assert fingerprint(solve(blocked, info.name, **info.params)) == fingerprint(
            solve(blocked, info.name)
        ), info.name


def test_parameters_change_the_run(blocked):
    assert solve(blocked, "RRT", range="0.2").polls != solve(blocked, "RRT").polls


@pytest.mark.parametrize(
    ("planner", "params", "message"),
    [
        ("FMT", {"radius_multiplier": "0.1"}, "FMT: radius_multiplier or num_samples is too small"),
        ("BFMT", {"nearest_k": "0", "extended_fmt": "1"}, "BFMT: .* needs extended_fmt 0"),
        ("RRTstar", {"ordered_sampling": "1"}, "RRTstar: ordered_sampling 1 needs informed_sampling 1"),
        (
            "KPIECE1",
            {"border_fraction": "0"},
            "KPIECE1.border_fraction = '0' is not a value that it takes; The",
        ),
        ("KPIECE1", {"min_valid_path_fraction": "2"}, "KPIECE1: .* must be in the range"),
    ],
)
def test_parameters_that_do_not_go_together_are_an_error(planner, params, message, free):
    with pytest.raises(ValueError, match=message):
        solve(free, planner, **params)


@pytest.mark.parametrize(
    "change",
    [
        {"start": HOME[:5]},
        {"goals": GOALS[:, :5].copy()},
        {"goals": GOALS[:0]},
        {"budget": native.Budget(state_checks=0, polls=1, seconds=1)},
    ],
)
def test_arguments_of_the_wrong_shape_or_size_are_errors(change, free):
    with pytest.raises(ValueError, match=r"start|goals|budget"):
        solve(free, "RRT", **change)


def test_tells_the_version_of_ompl():
    assert native.ompl_version().count(".") == 2
