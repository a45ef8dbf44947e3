from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"torch", "scipy", "sklearn", "pandas", "statsmodels"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "statement",
    [
        "from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings; TrainSettings(policies={})",
        "from plancurate.tasks.learning.settings import TrainSettings; TrainSettings(observation=('last_action',))",
        "from plancurate.tasks.curation.selectors.base import Settings, selector",
        "from plancurate.tasks.curation.learning_settings import LearningSettings",
    ],
)
def test_what_a_command_line_is_built_from_imports_nothing_heavy(statement: str) -> None:
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not HEAVY & {name.partition(".")[0] for name in done.stdout.split()}
