"""What a study says when it is over."""

from __future__ import annotations

from plancurate.flows.cli.console import output
from plancurate.flows.cli.tables import lines, matrix
from plancurate.tasks.study.context import StudyContext
from plancurate.tasks.study.results import StudyResults, study_results
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
    show_table(results)
    for what, where in (
        ("report", f"{study.home.reports / study.study / 'index.html'}"),
        ("lake", 'plancurate sql "SELECT * FROM evaluations LIMIT 5"'),
        ("pages", "plancurate serve (Prefect and MLflow on 127.0.0.1)"),
    ):
        output.print(f"{what:<7} {where}", highlight=False, soft_wrap=True)


def show_table(results: StudyResults) -> None:
    """Print success rates on the kind of test that headlines go by."""
    tests = results.headline
    first = lines(tests)[0]
    title = f"Success in percent at {first.tests} {tests.kind} test targets"
    output.print(matrix(tests, title))
    output.print(f"\\[95 % over {first.interval_over}]; {STARS}", style="dim")
