"""What a study is about, to be seen: its scenes, a good and a bad trajectory, selections, rollouts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from plancurate.errors import PlancurateError
from plancurate.tasks.lake.home import Home
from plancurate.tasks.pictures.files import COLOURS, png
from plancurate.tasks.pictures.film import still
from plancurate.tasks.pictures.shot import GOOD, Shot
from plancurate.tasks.report.contents import Figure, Section
from plancurate.tasks.report.svg import Drawing
from plancurate.tasks.study.against import BASELINE
from plancurate.tasks.study.context import PoolContext, StudyContext
from plancurate.tasks.study.predictor import reopened
from plancurate.tasks.study.results import StudyResults
from plancurate.tasks.study.rows import Cell
from plancurate.tasks.study.seen_candidates import extreme_shots, kept_shot
from plancurate.tasks.study.seen_rollouts import contrast_shots
from plancurate.tasks.study.trial_results import KindResults

SIZE = (480, 360)  # pixels
MOST_POOLS = 3  # that are shown more of than their scenes: seconds, and a page of a megabyte
SCORES = (
    "The best and the worst composite score of all candidates to the target where they are farthest apart."
)
KEPT = "The tool's path of each trajectory that is kept, at most some hundreds, and the training targets."
GOES = (
    "The tool's path and where the arm ends. Green: it reaches the target, the ring; red: it fails, and what touches "
    "then is red."
)

Note = Callable[[Sequence[Shot]], str]
"""What is said of a figure, by what could be shown."""


def study_pictures(home: Home, results: StudyResults) -> Section:
    """The section of pictures; where one can't be made, for a file or a network is gone, it says why in its place."""
    try:
        study = reopened(home, results.study.study)
    except PlancurateError as error:
        return Section("pictures", "Pictures", f"There are none: {error}")
    figures = [scenes_figure(study)]
    for pool in study.pools[:MOST_POOLS]:
        figures += pool_figures(study, pool, results)
    words = "Drawn from the shapes that planners and rollouts check; plancurate show draws them larger, and as films."
    return Section("pictures", "Pictures", words, figures)


def scenes_figure(study: StudyContext) -> Figure:
    """Every scene of the study with the arm where it starts."""
    pools = {pool.scene.name: pool for pool in study.pools}.values()
    shots = [Shot(pool.robot, pool.scenes_of_targets([0])[0], title=pool.scene.name) for pool in pools]
    title = "The robot in its scene" if len(shots) == 1 else "The robot in its scenes"
    note = f"Scene {', '.join(shot.title for shot in shots)}; the robot where it starts."
    return Figure("picture_scenes", title, note, [(shot.title, drawing(shot, [])) for shot in shots])


def pool_figures(study: StudyContext, pool: PoolContext, results: StudyResults) -> Iterator[Figure]:
    """Two trajectories, two selections and two rollouts of a pool."""
    number, where = study.pools.index(pool) + 1, f" in {pool.title}" if len(study.pools) > 1 else ""
    tests = pool_tests(results, pool)
    cells = shown_cells(tests, pool)

    def figure(key: str, title: str, note: Note, make: Callable[[], Sequence[Shot]]) -> Figure:
        return figure_of(f"picture_{key}_{number}", f"{title}{where}", note, make)

    yield figure(
        "extremes",
        "A good and a bad trajectory",
        lambda _: SCORES,
        lambda: extreme_shots(study, pool),
    )
    yield figure(
        "kept",
        "What selections keep",
        lambda _: KEPT,
        lambda: [kept_shot(study, pool, cell) for cell in cells],
    )
    yield figure(
        "rollouts",
        "A rollout that succeeds and one that fails",
        rollout_note,
        lambda: contrast_shots(study, pool, tests.kind, cells[0]),
    )


def pool_tests(results: StudyResults, pool: PoolContext) -> KindResults:
    """The results on the first kind of test that the pool has: where scenes vary, in others than elsewhere."""
    group = (pool.scene.name, pool.label)
    return next(
        tests for tests in results.tests.values() if any(row.group == group for row in tests.summaries)
    )


def shown_cells(tests: KindResults, pool: PoolContext) -> list[Cell]:
    """The best selection of a pool and General, which keeps everything, as far as the study has both."""
    rows = [row for row in tests.summaries if row.group == (pool.scene.name, pool.label)]
    best = [row.cell for row in rows if row.selector != BASELINE][:1]
    return best + [row.cell for row in rows if row.selector == BASELINE]


def rollout_note(shots: Sequence[Shot]) -> str:
    """What two rollouts show, or why there is one alone."""
    if len(shots) > 1:
        return f"{GOES} Both are sent to the same target where a test came out both ways: an example, not the rule."
    how = "reaches its target" if shots[0].runs[0].colour == GOOD else "fails"
    return f"{GOES} There is one alone, of {shots[0].title}: every tested rollout {how}."


def figure_of(key: str, title: str, note: Note, make: Callable[[], Sequence[Shot]]) -> Figure:
    """Shots beside each other, seen from the same place; the reason instead where there are none."""
    try:
        shots = make()
    except PlancurateError as error:
        return Figure(key, title, f"Not shown: {error}.", [])
    return Figure(key, title, note(shots), [(shot.title, drawing(shot, shots)) for shot in shots])


def drawing(shot: Shot, beside: Sequence[Shot]) -> Drawing:
    """The end of what a shot shows, in few colours; its title is the caption, and not in the picture again."""
    drawn = Drawing(*SIZE, "; ".join(filter(None, (shot.title, *(run.said for run in shot.runs)))))
    drawn.image(*SIZE, png(still(replace(shot, title=""), SIZE, beside), COLOURS))
    return drawn
