"""Robots that are added once for all tests."""

from __future__ import annotations

import pytest

from plancurate.robots.adding.add import Added, Request, add_robot

from .vendors import five_joint_arm, gripper_arm


@pytest.fixture(scope="session")
def five(tmp_path_factory) -> Added:
    """The five-joint arm."""
    folder = tmp_path_factory.mktemp("five")
    return add_robot(Request(five_joint_arm(folder), "tool", "five", folder / "robots", shapes_a_link=2))


@pytest.fixture(scope="session")
def gripper(tmp_path_factory) -> Added:
    """The arm with a gripper, held open."""
    folder = tmp_path_factory.mktemp("gripper")
    held = {"finger": 0.03}
    return add_robot(
        Request(gripper_arm(folder), "tool", "gripper", folder / "robots", joints=held, shapes_a_link=2)
    )
