"""Robots and scenes: what they are, loaded from files into plain arrays and the native model."""

from plancurate.robots.collisions import colliding_pairs
from plancurate.robots.inverse_kinematics import continue_ik, draw_ik, representatives, solve_ik
from plancurate.robots.loading import DEFAULT_ROBOT, DEFAULT_SCENE, load_robot, robot_names
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Region, Scene
from plancurate.robots.scene_loading import load_scene, load_world, scene_names

__all__ = [
    "DEFAULT_ROBOT",
    "DEFAULT_SCENE",
    "Region",
    "Robot",
    "Scene",
    "colliding_pairs",
    "continue_ik",
    "draw_ik",
    "load_robot",
    "load_scene",
    "load_world",
    "representatives",
    "robot_names",
    "scene_names",
    "solve_ik",
]
