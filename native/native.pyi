"""Compiled core: kinematics, collision checking and planning. Arrays are float64 and C-contiguous.

n joints, b states. The interpreter lock is released while the functions compute; Robot and Scene never
change, so threads may share them. Wrong shapes, kinds, indices and non-finite numbers raise ValueError.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
BoolArray = NDArray[np.bool_]

class Robot:
    """A chain of joints with primitive shapes on its frames."""

    def __init__(
        self,
        *,
        origins: FloatArray,
        axes: FloatArray,
        prismatic: BoolArray,
        tool: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        shape_kinds: IntArray,
        shape_frames: IntArray,
        shape_poses: FloatArray,
        shape_sizes: FloatArray,
        pairs: IntArray,
        scene_shapes: IntArray,
    ) -> None:
        """Build a robot; fixed joints must already be folded into its transforms.

        Args:
            origins: (n, 4, 4) fixed transforms, previous moving frame (or base) to joint i's frame.
            axes: (n, 3) unit axes in the joints' frames.
            prismatic: (n,) whether a joint slides along its axis rather than turning about it.
            tool: (4, 4) last moving frame to the tool frame.
            lower: (n,) lower planning limits, rad (m for prismatic joints).
            upper: (n,) upper planning limits.
            shape_kinds: (m,) 0 sphere, 1 capsule, 2 cylinder, 3 box.
            shape_frames: (m,) 0 the base, i + 1 the frame that moves with joint i.
            shape_poses: (m, 4, 4) poses in those frames; capsules and cylinders lie along z.
            shape_sizes: (m, 3), m: sphere (r, 0, 0); capsule and cylinder (r, half length, 0), a capsule's
                without its caps; box half extents.
            pairs: (p, 2) indices of shapes checked against each other.
            scene_shapes: (k,) indices of shapes checked against the scene.
        """

    @property
    def dof(self) -> int:
        """Number of joints."""

class Scene:
    """Obstacles in the robot's base frame."""

    def __init__(
        self,
        *,
        shape_kinds: IntArray,
        shape_poses: FloatArray,
        shape_sizes: FloatArray,
        ground: float | None,
        margin: float,
    ) -> None:
        """Build a scene from shapes described as a robot's are.

        Args:
            shape_kinds: (m,) 0 sphere, 1 capsule, 2 cylinder, 3 box.
            shape_poses: (m, 4, 4) poses in the base frame.
            shape_sizes: (m, 3), m.
            ground: height of a floor plane, m; None for no floor.
            margin: a state is free when every checked distance is provably larger, m.
        """

def fk(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the tool poses (b, 4, 4), m, of joint positions q (b, n)."""

def joint_frames(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the frames (b, n, 4, 4) that move with each joint, after its motion."""

def is_free(robot: Robot, scene: Scene, q: FloatArray) -> BoolArray:
    """Return which states q (b, n) are provably free of collision (b,). Joint limits are not looked at."""

def edge_is_free(robot: Robot, scene: Scene, q0: FloatArray, q1: FloatArray, resolution: float) -> BoolArray:
    """Return which straight edges from q0 to q1 (b, n) are free (b,).

    Looks at (1 - t) q0 + t q1 for t = i / k, i = 0..k, with k = ceil(max |q1 - q0| / resolution).
    The resolution is in rad (m for prismatic joints) and at least 1e-6.
    """

def clearance(robot: Robot, scene: Scene, q: FloatArray) -> FloatArray:
    """Return a certified lower bound (b,) of the smallest checked distance, m.

    Not positive where shapes touch, and then no measure of how deep; infinite where nothing is checked.
    """

def way_clearance(robot: Robot, scene: Scene, ways: FloatArray, most: float) -> FloatArray:
    """Return the smallest clearance (w,) at the points of each way (w, p, dof), m, from 0 to `most`.

    The very number that the smallest `clearance` of its points gives, clipped, in two thirds of the time.
    """

class Budget:
    """How much one planner run may use up."""

    state_checks: int
    polls: int
    seconds: float

    def __init__(self, *, state_checks: int, polls: int, seconds: float) -> None:
        """Set the limits; a run ends soon after the first of them is passed.

        Args:
            state_checks: collision checks of single states.
            polls: questions of the planner whether to go on, roughly its iterations; ends runs that check little.
            seconds: wall clock, s. A safety net: where it ends a run, the result depends on the machine.
        """

class Result:
    """What became of one planner run."""

    status: str
    """"exact", "approximate" (the path ends short of every goal) or "none"."""
    reason: str
    """Why the status is not "exact", else empty."""
    path: FloatArray
    """(w, n) waypoints from the start to a goal, whose edges are free at the resolution asked for; (0, n) if none."""
    cost: float
    """Euclidean length of the path, rad."""
    goal_index: int
    """The goal that the path ends at, -1 unless the status is "exact"."""
    state_checks: int
    """States the planner looked at; simplification and the final check of the path are not counted."""
    motion_checks: int
    """Edges the planner looked at."""
    polls: int
    """How often the planner asked whether to go on."""
    seconds: float
    """Wall clock of the whole call, s."""
    termination: str
    """What ended the run: "solved", "planner" (it gave up), "start" or "goal" (not usable), else the used-up limit:
    "state_checks", "polls" or "seconds". An optimizing planner with a solution usually ends at a limit."""

class PlannerInfo:
    """One of the planners."""

    name: str
    """OMPL's class name."""
    params: dict[str, str]
    """Its parameters by OMPL's names, with the values used unless `plan` is given others."""
    optimizing: bool
    """Goes on to improve its path until the budget ends or no path can be shorter."""
    deterministic: bool
    """The same arguments give the same path and counts, whatever runs beside it."""
    note: str
    """Why not, else empty."""

def plan(
    robot: Robot,
    scene: Scene,
    planner: str,
    start: FloatArray,
    goals: FloatArray,
    *,
    params: dict[str, str],
    seed: int,
    budget: Budget,
    resolution: float,
    simplification: str,
) -> Result:
    """Plan from start (n,) to any of goals (g, n), rad.

    The result depends on the arguments alone (but for `seconds`), unless its termination is "seconds". A start or
    goal that is outside the limits or in collision is a result with a reason, not an error.

    Args:
        robot: the arm.
        scene: what it must not touch.
        planner: OMPL's class name.
        start: joint positions.
        goals: joint positions, one goal a row.
        params: the planner's parameters by OMPL's names; those left out keep their values in `planners()`.
        seed: of everything random in the run, 0 .. 2**64 - 1.
        budget: how much the planner may use up.
        resolution: largest joint step between checked states of an edge, rad.
        simplification: "off" keeps the planner's path; "full" shortens it with OMPL's vertex reduction and shortcuts
            until nothing more is gained; "partial" tries a number of shortcuts drawn from the seed, none to two for
            each waypoint, as a simplifier leaves it whose time ran out.

    Raises:
        ValueError: unknown planner, parameter or simplification (the message lists the valid ones), a value that it
            does not take, arrays of the wrong shape.
    """

def simplify(
    robot: Robot, scene: Scene, path: FloatArray, *, seed: int, resolution: float = 0.01
) -> FloatArray:
    """Return a path (v, n), rad, no longer than `path` (w, n), with the very same ends and free as well.

    OMPL's vertex reduction and shortcuts, then its B-spline smoothing of the corners that are left, which gives up
    to eight times their waypoints. It depends on the arguments alone, whatever runs beside it.

    Args:
        robot: the arm.
        scene: what it must not touch.
        path: waypoints; joint limits are not looked at, and no waypoint leaves the range of these.
        seed: of the shortcuts tried, 0 .. 2**64 - 1.
        resolution: largest joint step between checked states of an edge, rad.

    Raises:
        ValueError: the path is empty or not free (the message says where), or has the wrong shape.
    """

def relax(
    robot: Robot,
    measured: Robot,
    scene: Scene,
    kept: Scene,
    path: FloatArray,
    offsets: FloatArray,
    pulls: FloatArray,
    resolution: float,
) -> FloatArray:
    """Return `path` (w, n), rad, w >= 3, with its ends, and its other waypoints moved round by round to cheaper places.

    An edge costs its length, rad, times 1 + 4 s: s is the mean over six points of the edge of ((0.08 - c) / 0.08)^2,
    with the clearance c there, m, taken between 0 and 0.08. In each round every other waypoint from the first inner
    one is moved, then those between: to the cheapest of where it is and the places tried for it, within the joint
    limits, if its edges there are free in `kept`.

    Args:
        robot: the arm.
        measured: the same without pairs of its own shapes, whose distances to the scene cost.
        scene: what it is better off.
        kept: what it must not touch.
        path: waypoints.
        offsets: (rounds, w - 2, d, n), rad, of places around the waypoint.
        pulls: (rounds, w - 2, p), shares of the way from the waypoint to the middle of its neighbours.
        resolution: largest joint step between checked states of an edge, rad.

    Raises:
        ValueError: arrays of the wrong shape, fewer than three waypoints.
    """

def planners() -> list[PlannerInfo]:
    """List all planners."""

def ompl_version() -> str:
    """Return the version of the OMPL library that this module was built with, as "1.5.2"."""
