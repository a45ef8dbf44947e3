"""What a notebook does with a finished study, without Prefect."""

from __future__ import annotations

import subprocess
import sys

from ..homes import environment
from .conftest import Studied

NOTEBOOK = """
import sys
from pathlib import Path
from plancurate.tasks.lake.home import Home
from plancurate.tasks.learning.rollouts import roll_out
from plancurate.tasks.learning.train import train
from plancurate.tasks.study.config import load_config
from plancurate.tasks.study.context import open_study
from plancurate.tasks.study.evaluations import study_tests
from plancurate.tasks.study.demonstrations import selected_demonstrations
from plancurate.tasks.study.results import study_results
from plancurate.tasks.study.selections import study_selections

study = open_study(load_config("smoke", None, {}), Home(Path(sys.argv[1])))
pool = study.pools[0]
wanted = {selection.title: selection for selection in study_selections(study)}["KMeans_Hybrid k=2"]
data = selected_demonstrations(study, wanted)
settings = study.config.training.model_copy(update={"steps": 20})
trained = train("BC_MLP", [data], [0], settings)
tests, dt = study_tests(study, pool), pool.settings.timing.dt
trials = roll_out(trained, pool.robot, pool.scene, tests, study.config.evaluation, dt)
rows = study_results(study.lake, study.study).headline.summaries
print(len(data.lengths), trials[0].num_rows, len(rows))
print("prefect" in sys.modules, "mlflow" in sys.modules)
"""


def test_demonstrations_training_rollouts_and_results_do_without_prefect(smoke: Studied) -> None:
    command = [sys.executable, "-c", NOTEBOOK, str(smoke.untouched)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=True)
    assert done.stdout.split("\n")[:2] == ["4 32 9", "False False"]
