"""Robots and scenes: what they are, loaded from files into plain arrays and the native model."""

from plancurate.robots.ik import solve_ik
from plancurate.robots.loading import load_robot, robot_names
from plancurate.robots.robot import Robot
from plancurate.robots.scene import Scene, load_scene, scene_names
from plancurate.robots.touching import touching

__all__ = ["Robot", "Scene", "load_robot", "load_scene", "robot_names", "scene_names", "solve_ik", "touching"]
