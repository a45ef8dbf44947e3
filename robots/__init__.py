"""Robots and scenes: what they are, loaded from files into plain arrays and the native model."""

from plancurate.robots.collisions import colliding_pairs
from plancurate.robots.inverse_kinematics import solve_ik
from plancurate.robots.loading import load_robot, robot_names
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene, load_scene, scene_names

__all__ = [
    "Robot",
    "Scene",
    "colliding_pairs",
    "load_robot",
    "load_scene",
    "robot_names",
    "scene_names",
    "solve_ik",
]
