"""Where a study works: its robot, scene, pool and lake, opened once and handed to every task."""

from __future__ import annotations

from plancurate import native
from plancurate.robots import load_robot, load_scene
from plancurate.tasks.candidates.generate import pool_id
from plancurate.tasks.candidates.targets import require_free_home
from plancurate.tasks.lake import Lake
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig


class Workplace:
    """A plain class on purpose: Prefect looks into dataclasses and models that are passed to a task, not into this."""

    def __init__(self, config: StudyConfig, home: Home) -> None:
        """Load what the configuration names; raises PlancurateError for what is not there."""
        self.config, self.home = config, home
        self.robot, self.scene = load_robot(config.robot), load_scene(config.scene)
        require_free_home(self.robot, self.scene)
        self.lake = Lake(home.lake)
        self.pool = pool_id(self.robot, self.scene, config.candidates)
        self.partition = {"robot": self.robot.name, "scene": self.scene.name, "pool": self.pool}
        self.metadata = {
            "pool": self.pool,
            "seed": str(config.candidates.targets.seed),
            "settings": config.candidates.model_dump_json(),
            "ompl_version": native.ompl_version(),
        }
