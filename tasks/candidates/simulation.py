"""A PyBullet simulation of one robot, in one scene or alone."""

from __future__ import annotations

import tempfile
import weakref
from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import Shape
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.payload import Payload
from plancurate.tasks.candidates.simulated_urdf import simulated_urdf

BASE = -1  # PyBullet's index of a body's root link
SHAPE_TYPES = {
    "sphere": bullet.GEOM_SPHERE,
    "capsule": bullet.GEOM_CAPSULE,
    "cylinder": bullet.GEOM_CYLINDER,
    "box": bullet.GEOM_BOX,
}
URDF_FLAGS = (
    bullet.URDF_USE_INERTIA_FROM_FILE
    | bullet.URDF_USE_IMPLICIT_CYLINDER  # else a cylinder becomes a prism
    | bullet.URDF_USE_SELF_COLLISION
    | bullet.URDF_USE_SELF_COLLISION_INCLUDE_PARENT
)


@dataclass(frozen=True)
class Contact:
    """Two things that touch: names of links, scene shapes or `ground`; `distance` in m is negative."""

    first: str
    second: str
    distance: float


@dataclass(frozen=True)
class Drives:
    """Position-controlled joints, one entry each: greatest torque or force, shares of the errors undone in a step."""

    effort: list[float]
    position_gain: list[float]
    velocity_gain: list[float]


JointState = tuple[float, float, tuple[float, ...], float]
"""Of PyBullet: position, velocity, reaction forces, torque or force of the motor."""


class World:
    """A PyBullet client of its own; `build` fills it. One thread at a time may use it."""

    def __init__(self) -> None:
        self.client: int = bullet.connect(bullet.DIRECT)
        weakref.finalize(self, bullet.disconnect, self.client)
        self.names: dict[tuple[int, int], str] = {}
        self.solid = True
        self.body = -1
        self.joints: list[int] = []

    def build(
        self, robot: Robot, scene: Scene, step_s: float = 1.0 / 240.0, payload: Payload | None = None
    ) -> None:
        """Empty the world, put `robot` with its payload and `scene` in; contacts that may be are switched off."""
        links = self._reset(robot, step_s, payload, solid=True)
        for pair in robot.allowed_contacts:
            first, second = (links[name] for name in pair)
            bullet.setCollisionFilterPair(self.body, self.body, first, second, 0, physicsClientId=self.client)
        for body in self._obstacles(scene):
            for name in robot.scene_unchecked_links:
                bullet.setCollisionFilterPair(
                    self.body, body, links[name], BASE, 0, physicsClientId=self.client
                )

    def build_alone(self, robot: Robot, step_s: float = 1.0 / 240.0, payload: Payload | None = None) -> None:
        """Empty the world, put `robot` with its payload in, without shapes: it moves alike and touches nothing."""
        self._reset(robot, step_s, payload, solid=False)

    def place(self, q: list[float]) -> None:
        """Put the joints at `q`, at rest."""
        for joint, value in zip(self.joints, q, strict=True):
            bullet.resetJointState(self.body, joint, value, physicsClientId=self.client)

    def step(self, drives: Drives, q: list[float], velocity: list[float]) -> tuple[JointState, ...]:
        """Control one step from where the joints should be, `q`, at `velocity`; give each joint's state."""
        # By position: names cost a tenth of the calls.
        bullet.setJointMotorControlArray(
            self.body,
            self.joints,
            bullet.POSITION_CONTROL,
            q,
            velocity,
            drives.effort,
            drives.position_gain,
            drives.velocity_gain,
            self.client,
        )
        bullet.stepSimulation(self.client)
        states: tuple[JointState, ...] = bullet.getJointStates(self.body, self.joints, self.client)
        return states

    def contacts(self) -> tuple[Contact, ...]:
        """What touched at the last collision detection; PyBullet lists near misses too, they are left out."""
        if not self.solid:
            return ()
        return tuple(
            Contact(self.names[point[1], point[3]], self.names[point[2], point[4]], point[8])
            for point in bullet.getContactPoints(physicsClientId=self.client)
            if point[8] < 0.0
        )

    def touching(self, q: list[float]) -> tuple[Contact, ...]:
        """What touches with the joints at `q`, at rest."""
        self.place(q)
        bullet.performCollisionDetection(physicsClientId=self.client)
        return self.contacts()

    def torques(self, q: list[float], velocity: list[float], acceleration: list[float]) -> list[float]:
        """Torques or forces that the joints need for this motion, by inverse dynamics; gravity included."""
        found = bullet.calculateInverseDynamics(
            self.body, q, velocity, acceleration, physicsClientId=self.client
        )
        return list(found)

    def _reset(self, robot: Robot, step_s: float, payload: Payload | None, solid: bool) -> dict[str, int]:
        """Empty the world but for the robot; return the numbers of its links by name."""
        bullet.resetSimulation(physicsClientId=self.client)
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=self.client)
        bullet.setTimeStep(step_s, physicsClientId=self.client)
        self.solid = solid
        self.body = self._load(robot, payload)
        joints, links = self._indices()
        self.names = {(self.body, index): name for name, index in links.items()}
        self.joints = [joints[name] for name in robot.joint_names]
        for index in links.values():  # PyBullet would brake every link a little
            bullet.changeDynamics(
                self.body, index, linearDamping=0, angularDamping=0, physicsClientId=self.client
            )
        return links

    def _load(self, robot: Robot, payload: Payload | None) -> int:
        """Load the robot through a file of its own, which is gone afterwards."""
        with tempfile.NamedTemporaryFile(suffix=".urdf") as file:
            file.write(simulated_urdf(robot.urdf, robot.digest, robot.tool_link, payload, self.solid))
            file.flush()
            body: int = bullet.loadURDF(
                file.name, useFixedBase=True, flags=URDF_FLAGS, physicsClientId=self.client
            )
        return body

    def _indices(self) -> tuple[dict[str, int], dict[str, int]]:
        """PyBullet's numbers of the joints and of the links by name."""
        root = bullet.getBodyInfo(self.body, physicsClientId=self.client)[0].decode()
        count = bullet.getNumJoints(self.body, physicsClientId=self.client)
        infos = [bullet.getJointInfo(self.body, index, physicsClientId=self.client) for index in range(count)]
        links = {root: BASE} | {info[12].decode(): info[0] for info in infos}
        return {info[1].decode(): info[0] for info in infos}, links

    def _obstacles(self, scene: Scene) -> list[int]:
        """Add floor and shapes; return their bodies."""
        bodies = []
        if scene.ground is not None:
            plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=self.client)
            bodies.append(self._fixed(plane, "ground", [0.0, 0.0, scene.ground], [0.0, 0.0, 0.0, 1.0]))
        for entry in scene.shapes:
            pose = entry.shape.pose
            turn = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
            bodies.append(self._fixed(self._solid(entry.shape), entry.name, pose[:3, 3].tolist(), turn))
        return bodies

    def _fixed(self, solid: int, name: str, position: list[float], turn: list[float]) -> int:
        body: int = bullet.createMultiBody(0.0, solid, -1, position, turn, physicsClientId=self.client)
        self.names[body, BASE] = name
        return body

    def _solid(self, shape: Shape) -> int:
        """Collision shape in PyBullet's own terms: full heights, half extents."""
        sizes: dict[str, object] = {"halfExtents": shape.size}
        if shape.kind != "box":
            sizes = {"radius": shape.size[0], "height": 2.0 * shape.size[1]}
        solid: int = bullet.createCollisionShape(
            SHAPE_TYPES[shape.kind], physicsClientId=self.client, **sizes
        )
        return solid
