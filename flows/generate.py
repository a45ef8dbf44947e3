"""Plan, time, play back and store every candidate that the lake does not hold yet."""

from __future__ import annotations

from dataclasses import dataclass

from prefect import flow, task
from prefect.cache_policies import NO_CACHE

from plancurate.errors import IncompleteError
from plancurate.flows.artifacts import table_artifact
from plancurate.flows.cli.console import console
from plancurate.flows.progress import Bar, stage
from plancurate.flows.task_runs import is_transient, run_all
from plancurate.tasks.candidates.generate import generate_candidates
from plancurate.tasks.candidates.postprocess_pool import PostprocessPool
from plancurate.tasks.candidates.target_table import stored_targets, target_rows, targets_key
from plancurate.tasks.candidates.targets import Target, sample_targets
from plancurate.tasks.lake.home import Home
from plancurate.tasks.study.config import StudyConfig
from plancurate.tasks.study.context import Workplace


@dataclass(frozen=True)
class Part:
    """One planner's runs for some targets: what one task run plans and one file of the lake holds."""

    planner: str
    targets: tuple[Target, ...]

    @property
    def label(self) -> str:
        """Name of the part: the target's number, or the first and the last of several."""
        first, last = self.targets[0].target_id, self.targets[-1].target_id
        return f"{first:04d}" if first == last else f"{first:04d}-{last:04d}"


@flow(name="generate", flow_run_name="generate {config.name}")
def generate(config: StudyConfig, home: str | None = None) -> None:
    """Fill the lake with candidates: one task run for each planner and target, its runs inside.

    Doing it again plans only what is missing; a larger study reuses what a smaller one left.
    """
    place = Workplace(config, Home.resolve(home))
    place.lake.sweep()
    targets = sample(place)
    parts = missing_parts(place, targets)
    runs = config.candidates.plan.runs * sum(len(part.targets) for part in parts)
    if parts:
        with (
            PostprocessPool(
                config.robot, config.scene, config.candidates.timing, config.candidates.verify, config.workers
            ) as finish,
            stage("plan", runs, "runs") as bar,
        ):
            calls = ((place, part, part.planner, part.label, finish, bar) for part in parts)
            run_all(
                plan_part, calls, 2 * config.workers
            )  # one plans and writes while another is timed and played
    if missing := missing_parts(place, targets):
        raise IncompleteError(f"{len(missing)} parts are not in the lake, the first {missing[0]}")
    say_how_many_differ(place)
    planners = place.lake.query("results/planners", **place.partition)
    table_artifact("planners", planners.to_pylist(), "What each planner solved, and how long it took.")


@task(task_run_name="sample targets", cache_policy=NO_CACHE, persist_result=False)
def sample(place: Workplace) -> list[Target]:
    """Return the study's targets from the lake, drawing those that are not there yet."""
    known, count = stored_targets(place.lake, place.partition), place.config.n_targets
    if len(known) < count:
        new = sample_targets(
            place.robot, place.scene, place.config.candidates.targets, len(known), count - len(known)
        )
        place.lake.write("targets", place.partition, targets_key(new), target_rows(new), place.metadata)
        known += new
    return known[:count]


def missing_parts(place: Workplace, targets: list[Target]) -> list[Part]:
    """Return what the lake lacks of the study's candidates, in groups of `targets_per_task`, target by target."""
    planned = place.lake.query("pool/planned", **place.partition).to_pylist()
    done = {(row["planner"], row["target_id"]) for row in planned}
    parts, size = [], place.config.targets_per_task
    for planner in place.config.planners:
        left = [target for target in targets if (planner, target.target_id) not in done]
        parts += [Part(planner, tuple(left[i : i + size])) for i in range(0, len(left), size)]
    return sorted(parts, key=lambda part: part.label)


def say_how_many_differ(place: Workplace) -> None:
    """Print how many candidates are distinct: curation can only choose among those."""
    counts = place.lake.query("results/equal_candidates", **place.partition).to_pylist()
    distinct, candidates = (
        sum(row[name] for row in counts) for name in ("distinct_candidates", "candidates")
    )
    if distinct < candidates:
        console.print(f"  {candidates} solved and verified, {distinct} of them distinct", style="dim")


# No tags: for a tagged task run Prefect asks its server for a concurrency slot, a tenth of the run's own work.
@task(
    name="plan",
    task_run_name="plan {planner} target {label}",
    retries=2,
    retry_delay_seconds=1,
    retry_condition_fn=is_transient,
    timeout_seconds=3600,
    cache_policy=NO_CACHE,
    persist_result=False,
)
def plan_part(
    place: Workplace, part: Part, planner: str, label: str, finish: PostprocessPool, bar: Bar
) -> None:
    """Plan, time and verify one part and write it to the lake; runs without a solution are rows with a reason."""
    rows, _ = generate_candidates(
        place.robot, place.scene, list(part.targets), planner, place.config.candidates, finish
    )
    place.lake.write("trajectories", {**place.partition, "planner": planner}, label, rows, place.metadata)
    bar.advance(rows.num_rows, rows["solved"].to_pylist().count(False))
