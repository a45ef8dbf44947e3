"""A PyBullet simulation of one robot in one scene, rebuilt from nothing each time so that runs cannot mix."""

from __future__ import annotations

import tempfile
import weakref
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from scipy.spatial.transform import Rotation

from plancurate.robots import Robot, Scene
from plancurate.robots.shapes import Shape
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.payload import Payload

PAYLOAD = "plancurate_payload"
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
    """Position-controlled joints: greatest torque or force of each, share of the errors undone in a step."""

    effort: list[float]
    position_gain: float
    velocity_gain: float


class World:
    """A PyBullet client of its own; `build` fills it. One thread at a time may use it."""

    def __init__(self) -> None:
        self.client: int = bullet.connect(bullet.DIRECT)
        weakref.finalize(self, bullet.disconnect, self.client)
        self.names: dict[tuple[int, int], str] = {}
        self.body = -1
        self.joints: list[int] = []

    def build(
        self, robot: Robot, scene: Scene, step_s: float = 1.0 / 240.0, payload: Payload | None = None
    ) -> None:
        """Empty the world, put `robot` with its payload and `scene` in; contacts that may be are switched off."""
        bullet.resetSimulation(physicsClientId=self.client)
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=self.client)
        bullet.setTimeStep(step_s, physicsClientId=self.client)
        self.body = self._load(robot, payload)
        joints, links = self._indices()
        self.names = {(self.body, index): name for name, index in links.items()}
        self.joints = [joints[name] for name in robot.joint_names]
        for index in links.values():  # PyBullet would brake every link a little
            bullet.changeDynamics(
                self.body, index, linearDamping=0, angularDamping=0, physicsClientId=self.client
            )
        for pair in robot.allowed_contacts:
            first, second = (links[name] for name in pair)
            bullet.setCollisionFilterPair(self.body, self.body, first, second, 0, physicsClientId=self.client)
        for body in self._obstacles(scene):
            for name in robot.scene_unchecked_links:
                bullet.setCollisionFilterPair(
                    self.body, body, links[name], BASE, 0, physicsClientId=self.client
                )

    def place(self, q: list[float]) -> None:
        """Put the joints at `q`, at rest."""
        for joint, value in zip(self.joints, q, strict=True):
            bullet.resetJointState(self.body, joint, value, physicsClientId=self.client)

    def step(self, drives: Drives, q: list[float], velocity: list[float]) -> tuple[list[float], list[float]]:
        """Control one step from where the joints should be, `q`, at `velocity`; give positions, torques."""
        bullet.setJointMotorControlArray(
            self.body,
            self.joints,
            bullet.POSITION_CONTROL,
            targetPositions=q,
            targetVelocities=velocity,
            forces=drives.effort,
            positionGains=[drives.position_gain] * len(q),
            velocityGains=[drives.velocity_gain] * len(q),
            physicsClientId=self.client,
        )
        bullet.stepSimulation(physicsClientId=self.client)
        states = bullet.getJointStates(self.body, self.joints, physicsClientId=self.client)
        return [state[0] for state in states], [state[3] for state in states]

    def contacts(self) -> tuple[Contact, ...]:
        """What touched at the last collision detection; PyBullet lists near misses too, they are left out."""
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

    def _load(self, robot: Robot, payload: Payload | None) -> int:
        """Load the robot through a file of its own, which is gone afterwards."""
        with tempfile.NamedTemporaryFile(suffix=".urdf") as file:
            file.write(_clean_urdf(robot.urdf, robot.digest, robot.tool_link, payload))
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


@lru_cache
def _clean_urdf(file: Path, digest: str, tool_link: str, payload: Payload | None) -> bytes:
    """The URDF without visuals; a link without inertia weighs nothing (PyBullet would take 1 kg and say so).

    A payload is a link of its own, a point mass fixed to the tool. `digest` is there for the cache: another content
    of the file is another entry.
    """
    tree = ET.parse(file).getroot()
    for link in tree.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        if link.find("inertial") is None:
            _add_mass(link, 0.0)
    if payload is not None:
        _add_payload(tree, tool_link, payload)
    return ET.tostring(tree)


def _add_payload(tree: ET.Element, tool_link: str, payload: Payload) -> None:
    _add_mass(ET.SubElement(tree, "link", name=PAYLOAD), payload.mass_kg)
    joint = ET.SubElement(tree, "joint", name=f"{PAYLOAD}_mount", type="fixed")
    ET.SubElement(joint, "parent", link=tool_link)
    ET.SubElement(joint, "child", link=PAYLOAD)
    ET.SubElement(joint, "origin", xyz=" ".join(map(str, payload.centre_m)), rpy="0 0 0")


def _add_mass(link: ET.Element, mass: float) -> None:
    """Give a link a point mass at its origin."""
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "mass", value=str(mass))
    ET.SubElement(inertial, "inertia", ixx="0", ixy="0", ixz="0", iyy="0", iyz="0", izz="0")
