"""What a study says when it is over."""

from __future__ import annotations

from plancurate.flows.cli.console import output
from plancurate.flows.cli.tables import lines, matrix
from plancurate.tasks.learning.test_targets import UNSEEN_SCENE
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.trial_results import KindResults
from plancurate.tasks.study.verdict import verdicts

STARS = "*, **, ***: differs from General on the same test targets, p < 0.05, 0.01, 0.001 (Holm)"


def show_results(study: StudyContext) -> None:
    """Print the verdict on a study, its table of success rates and where to look next."""
    results = study_results(study.lake, study.study)
    output.print()
    for verdict in verdicts(results):
        output.print(verdict.which, style="bold", markup=False, highlight=False)
        for sentence in verdict.sentences[1:]:
            output.print(sentence, markup=False, highlight=False)
    output.print()
    for kind in dict.fromkeys((results.headline.kind, UNSEEN_SCENE)):
        if kind in results.tests:
            show_table(results.tests[kind])
    for what, where in (
        ("report", f"{study.home.reports / study.study / 'index.html'}"),
        ("lake", 'plancurate sql "SELECT * FROM evaluations LIMIT 5"'),
        ("pages", "plancurate serve (Prefect and MLflow on 127.0.0.1)"),
    ):
        output.print(f"{what:<7} {where}", highlight=False, soft_wrap=True)


def show_table(tests: KindResults) -> None:
    """Print success rates on one kind of test."""
    first = lines(tests)[0]
    what = "tests in scenes never trained in" if tests.kind == UNSEEN_SCENE else f"{tests.kind} test targets"
    title = f"Success in percent at {first.tests} {what}"
    output.print(matrix(tests, title))
    output.print(f"\\[95 % over {first.interval_over}]; {STARS}", style="dim")
