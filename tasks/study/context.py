"""What a study works with: its robot, scenes, pools and lake, loaded from a configuration and a home folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations

from plancurate import __version__, native
from plancurate.errors import PlancurateError
from plancurate.robots import Robot, Scene, load_robot, load_world
from plancurate.robots.scene_family import SceneFamily, is_family, load_family
from plancurate.tasks.candidates import path_classes
from plancurate.tasks.candidates.generate import pool_id
from plancurate.tasks.candidates.settings import GenerateSettings
from plancurate.tasks.candidates.sources import find_source
from plancurate.tasks.candidates.targets import require_free_home
from plancurate.tasks.curation.learning_settings import LearningSettings
from plancurate.tasks.lake.home import Home
from plancurate.tasks.lake.store import Lake
from plancurate.tasks.learning import corrections, nearest_clusters, rollouts, train, training_goals
from plancurate.tasks.learning.observations import find_term, goal_terms
from plancurate.tasks.learning.policies import kind_of
from plancurate.tasks.learning.settings import TrainSettings
from plancurate.tasks.learning.test_targets import UNSEEN_SCENE
from plancurate.tasks.motion import verify
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.identity import digest

# What these say is in the ids of the pools, or says only how fast a study runs and what it is called.
_NOT_IN_KEY = {
    "name", "robot", "scenes", "candidates", "pools", "planners",
    "workers", "targets_per_task", "runner", "dask_scheduler", "ray_address",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PoolContext:
    """One pool of a study: candidates of one scene, made with one variant of the settings."""

    pool: str
    """The pool's id, a hash of all that decides its candidates."""
    label: str
    """The variant's name; empty where the study has a single one."""
    robot: Robot
    scene: Scene
    """Where scenes vary, what all have in common."""
    scene_source: str
    """The scene as the configuration names it: what another process loads it by."""
    settings: GenerateSettings
    family: SceneFamily | None = None
    """The scenes, where they vary."""

    @property
    def partition(self) -> dict[str, str]:
        """Return where the lake keeps the pool."""
        return {"robot": self.robot.name, "scene": self.scene.name, "pool": self.pool}

    @property
    def metadata(self) -> dict[str, str]:
        """What the footers of the pool's parts say of where they come from."""
        return {
            "pool": self.pool,
            "seed": str(self.settings.targets.seed),
            "settings": self.settings.model_dump_json(),
            "ompl_version": native.ompl_version(),
        }

    def with_runs(self, runs: int) -> PoolContext:
        """Return the pool that is made alike with another number of runs to each target."""
        plan = self.settings.plan.model_copy(update={"runs": runs})
        settings = self.settings.model_copy(update={"plan": plan})
        return replace(self, settings=settings, pool=pool_id(self.robot, self.scene, settings))

    def training(self, config: StudyConfig) -> TrainSettings:
        """Return how the study trains on this pool: where scenes vary, policies observe them."""
        if self.family is None:
            return config.training
        return config.training.model_copy(update={"observation": config.varying_observation})

    def learning(self, config: StudyConfig) -> LearningSettings:
        """Return the study's settings as selectors that train, roll out or time use them."""
        return LearningSettings(self.training(config), config.evaluation, self.settings.timing)

    def require_one_scene(self, doing: str) -> None:
        """Raise PlancurateError where scenes vary, for what is done in one."""
        if self.family is not None:
            raise PlancurateError(
                f"{doing}: the scenes {self.scene_source} vary, and one is needed; name a study of one scene, "
                f"such as {self.family.training(0)}"
            )

    def source_of_target(self, target_id: int) -> str:
        """Return what the scene of a training target is loaded by."""
        return self.scene_source if self.family is None else self.family.training(target_id)

    def scenes_of_targets(self, target_ids: Sequence[int]) -> list[Scene]:
        """Return the scene that each training target lies in."""
        if self.family is None:
            return [self.scene] * len(target_ids)
        return [self.family.member(self.family.training(target_id)) for target_id in target_ids]

    def scenes_of_tests(self, kinds: Sequence[str], target_ids: Sequence[int]) -> list[Scene]:
        """Return the scene that each test lies in, by its kind and the number of its target."""
        if self.family is None:
            return [self.scene] * len(kinds)
        sources = (
            self.family.unseen(target) if kind == UNSEEN_SCENE else self.family.training(target)
            for kind, target in zip(kinds, target_ids, strict=True)
        )
        return [self.family.member(source) for source in sources]

    @property
    def title(self) -> str:
        """Name the pool for a person."""
        return f"{self.scene.name} {self.label}".strip()


@dataclass(frozen=True, eq=False)
class StudyContext:
    """A study opened: everything that its stages work with."""

    config: StudyConfig
    home: Home
    pools: tuple[PoolContext, ...]

    @cached_property
    def lake(self) -> Lake:
        """The lake of the home folder."""
        return Lake(self.home.lake)

    @cached_property
    def key(self) -> str:
        """Hash of everything that decides the results: two studies with the same key have the same numbers."""
        config = self.config
        corrected, verified = config.corrections.rounds > 0, config.verified_tests > 0
        # What a study does without is not in its key, so that studies from before it was there keep theirs.
        optional = {
            "corrections": corrected,
            "verified_tests": verified,
            "displaced_targets": config.displaced_targets is not None,
            "one_policy_a": config.one_policy_a != "selection",
            "varying_observation": any(pool.family for pool in self.pools),
        }
        absent = {name for name, there in optional.items() if not there}
        terms = config.training.observation + config.varying_observation * optional["varying_observation"]
        content = {
            "pools": [[pool.label, pool.pool] for pool in self.pools],
            "config": config.model_dump(mode="json", exclude=_NOT_IN_KEY | absent),
            "planners": sorted(self.sources),
            "selectors": [[c.selector.origin, c.selector.revision] for c in config.selectors],
            "policies": [kind_of(name).revision for name in config.policies],
            "observation": [find_term(name).revision for name in terms],
            "stages": [path_classes.REVISION, train.REVISION, rollouts.REVISION]
            + [corrections.REVISION] * corrected
            + [verify.REVISION] * verified
            + [training_goals.REVISION] * bool(goal_terms(terms))
            + [nearest_clusters.REVISION] * optional["one_policy_a"],
        }
        return digest(content, 8)

    @property
    def sources(self) -> tuple[str, ...]:
        """What the lake keeps the trajectories of each planner under."""
        return tuple(find_source(name).label for name in self.config.planners)

    @property
    def labelling(self) -> str:
        """What the lake keeps the ways of the study's candidates under: they are labelled beside each other."""
        return digest([path_classes.REVISION, sorted(self.sources)], 8)

    @property
    def study(self) -> str:
        """The study's identifier in the lake and in MLflow: changed settings under a name are another study."""
        return f"{self.config.name}-{self.key}"

    @property
    def metadata(self) -> dict[str, str]:
        """What the footer of every part says of where it comes from."""
        return {"study": self.study, "package_version": __version__, "ompl_version": native.ompl_version()}

    def pool(self, pool: str) -> PoolContext:
        """Return the pool of that id."""
        return next(context for context in self.pools if context.pool == pool)

    def study_partition(self, pool: PoolContext) -> dict[str, str]:
        """Return where the lake keeps what the study made of a pool."""
        return {**pool.partition, "study": self.study}


@dataclass(frozen=True)
class StudyRef:
    """A study as a task receives it: plain text that crosses to any thread, process or machine."""

    config: str
    """JSON."""
    home: str
    key: str
    """What the study was when its flow began."""

    def open(self) -> StudyContext:
        """Open the study; PlancurateError when a file that it is made of changed since its flow began."""
        return _opened(self)


def open_study(config: StudyConfig, home: Home) -> StudyContext:
    """Load what the configuration names; raises PlancurateError for what is not there or does not fit."""
    pools = tuple(_pools(config))
    for one, other in combinations(pools, 2):
        if one.title == other.title:
            raise PlancurateError(f"scenes: two are called '{one.scene.name}'; rename one of the files")
        if one.pool == other.pool:
            raise PlancurateError(
                f"pools: '{one.title}' and '{other.title}' are made alike; name only one of them"
            )
    return StudyContext(config, home, pools)


def reference(study: StudyContext) -> StudyRef:
    """Return what a task needs to open the study again."""
    return StudyRef(study.config.model_dump_json(), str(study.home.root), study.key)


def _pools(config: StudyConfig) -> Iterator[PoolContext]:
    for source in config.scenes:
        if is_family(source):
            robot = load_robot(config.robot)
            family = load_family(source, robot)
            scene = family.shared
        else:
            robot, scene = load_world(config.robot, source)
            family = None
            require_free_home(robot, scene)
        for label in config.pool_labels:
            settings = config.pool_settings(label)
            yield PoolContext(pool_id(robot, scene, settings), label, robot, scene, source, settings, family)


@lru_cache(maxsize=4)  # loading a robot takes longer than what many a task does with it
def _opened(reference: StudyRef) -> StudyContext:
    config = StudyConfig.model_validate_json(reference.config)
    study = open_study(config, Home.resolve(reference.home))
    if study.key != reference.key:
        raise PlancurateError(
            f"study {config.name}: a file of robot {config.robot} or of scenes {', '.join(config.scenes)} changed "
            "while it ran; start it again"
        )
    return study
