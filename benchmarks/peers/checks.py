"""State checks by PyBullet, and by Pinocchio with Coal: what `native` is compared with."""

from __future__ import annotations

import numpy as np
import pinocchio
from coal import Box, Capsule, CollisionGeometry, Cylinder, Halfspace, Sphere

from plancurate.robots import Robot, Scene
from plancurate.robots.contacts import checked_pairs, scene_shapes
from plancurate.robots.shapes import FloatArray, Shape
from plancurate.tasks.candidates.bullet import bullet
from plancurate.tasks.candidates.simulation import World


class BulletChecks:
    """PyBullet, state by state, in the fewest calls: place all joints at once, detect, look for contacts."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.world = World()
        self.world.build(robot, scene)

    def is_free(self, q: list[float]) -> bool:
        """Say whether a state (n,) is free."""
        body, joints, client = self.world.body, self.world.joints, self.world.client
        bullet.resetJointStatesMultiDof(body, joints, [[value] for value in q], physicsClientId=client)
        bullet.performCollisionDetection(physicsClientId=client)
        return all(point[8] >= 0 for point in bullet.getContactPoints(physicsClientId=client))


class BulletPairChecks(BulletChecks):
    """PyBullet as public interfaces to OMPL ask it: joint by joint, then pair by pair of links and bodies."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        super().__init__(robot, scene)
        links = {name: index for (body, index), name in self.world.names.items() if body == self.world.body}
        obstacles = [body for body, _ in self.world.names if body != self.world.body]
        solid = {shape.link for shape in robot.shapes}
        self.pairs = [
            (self.world.body, links[robot.shapes[a].link], links[robot.shapes[b].link])
            for a, b in checked_pairs(robot.shapes, robot.allowed_contacts)
        ]
        outside = solid - robot.scene_unchecked_links
        self.pairs += [(body, links[link], -1) for body in obstacles for link in outside]

    def is_free(self, q: list[float]) -> bool:
        """Say whether a state (n,) is free."""
        body, client = self.world.body, self.world.client
        self.world.place(q)
        return not any(
            bullet.getClosestPoints(body, other, 0.0, link, other_link, physicsClientId=client)
            for other, link, other_link in self.pairs
        )


class CoalChecks:
    """Pinocchio's kinematics and Coal's collision detection, state by state, up to the first collision."""

    def __init__(self, robot: Robot, scene: Scene) -> None:
        self.model, self.geometry = pinocchio.Model(), pinocchio.GeometryModel()
        for i, name in enumerate(robot.joint_names):
            origin = pinocchio.SE3(robot.chain.origins[i])
            self.model.addJoint(i, joint_model(robot.chain.axes[i], robot.chain.prismatic[i]), origin, name)
        for i, link in enumerate(robot.shapes):
            self._add(f"robot {i}", link.frame, link.shape.pose, solid_of(link.shape))
        for a, b in checked_pairs(robot.shapes, robot.allowed_contacts):
            self.geometry.addCollisionPair(pinocchio.CollisionPair(int(a), int(b)))
        for i, (pose, solid) in enumerate(obstacles(scene)):
            obstacle = self._add(f"scene {i}", 0, pose, solid)
            for link in scene_shapes(robot.shapes, robot.scene_unchecked_links):
                self.geometry.addCollisionPair(pinocchio.CollisionPair(int(link), obstacle))
        self.data, self.geometry_data = self.model.createData(), self.geometry.createData()

    def _add(self, name: str, joint: int, pose: FloatArray, solid: CollisionGeometry) -> int:
        placement = pinocchio.SE3(pose)
        return int(self.geometry.addGeometryObject(pinocchio.GeometryObject(name, joint, placement, solid)))

    def is_free(self, q: FloatArray) -> bool:
        """Say whether a state (n,) is free."""
        return not pinocchio.computeCollisions(
            self.model, self.data, self.geometry, self.geometry_data, q, True
        )


def joint_model(axis: FloatArray, prismatic: bool) -> pinocchio.JointModel:
    """Build Pinocchio's joint about or along `axis` (3,); about z it has a faster one."""
    if prismatic:
        return pinocchio.JointModelPrismaticUnaligned(axis)
    return (
        pinocchio.JointModelRZ()
        if np.array_equal(axis, [0, 0, 1])
        else pinocchio.JointModelRevoluteUnaligned(axis)
    )


def obstacles(scene: Scene) -> list[tuple[FloatArray, CollisionGeometry]]:
    """Poses (4, 4) and Coal's shapes of a scene, its floor included."""
    solids = [(entry.shape.pose, solid_of(entry.shape)) for entry in scene.shapes]
    if scene.ground is not None:
        solids.append((np.eye(4), Halfspace(np.array([0.0, 0.0, 1.0]), scene.ground)))
    return solids


def solid_of(shape: Shape) -> CollisionGeometry:
    """Build Coal's shape, which takes full lengths."""
    a, b, c = shape.size
    return {
        "sphere": lambda: Sphere(a),
        "capsule": lambda: Capsule(a, 2 * b),
        "cylinder": lambda: Cylinder(a, 2 * b),
        "box": lambda: Box(2 * a, 2 * b, 2 * c),
    }[shape.kind]()
