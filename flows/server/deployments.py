"""The deployments of the package's prefect.yaml, registered with a Prefect server."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import plancurate
from plancurate.errors import PlancurateError
from plancurate.flows.server.services import last_line

if TYPE_CHECKING:
    from prefect.client.schemas.actions import WorkPoolCreate

POOL = "plancurate"
FOLDER = Path(plancurate.__file__).parent  # holds prefect.yaml and the flows, installed or in the repository
DEPLOY = [sys.executable, "-m", "prefect", "--no-prompt", "deploy", "--all"]


def deploy(log: Path) -> None:
    """Create the work pool and register every deployment; PlancurateError where Prefect refuses one.

    A schedule or an automation that somebody switched on stays on: the file only says how it starts out. What Prefect
    says of it is written to `log`.
    """
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        client.create_work_pool(_work_pool(), overwrite=True)
        deployments = client.read_deployments()
        schedules = [(item.id, plan.id) for item in deployments for plan in item.schedules if plan.active]
        automations = {item.name for item in client.read_automations() if item.enabled}
        variables = {**os.environ, "PWD": str(FOLDER)}  # where the file says that its entry points lie
        with log.open("wb") as output:
            done = subprocess.run(
                DEPLOY, cwd=FOLDER, env=variables, stdout=output, stderr=output, check=False
            )
        if done.returncode:
            raise PlancurateError(f"{log}: prefect deploy failed: {last_line(log)}")
        for deployment, schedule in schedules:
            client.update_deployment_schedule(deployment, schedule, active=True)
        for automation in client.read_automations():  # Prefect makes those of a deployment anew
            if automation.name in automations and not automation.enabled:
                client.resume_automation(automation.id)


def _work_pool() -> WorkPoolCreate:
    """A pool of processes that stay in their worker's process group, so that they end with it."""
    from prefect.client.schemas.actions import WorkPoolCreate
    from prefect.workers.process import ProcessWorker

    template = ProcessWorker.get_default_base_job_template()
    # Left to itself, a worker starts each run in a session of its own, where it outlives a killed worker.
    template["variables"]["properties"]["command"]["default"] = shlex.join(
        [sys.executable, "-m", "prefect.engine"]
    )
    description = "Processes on the machine of plancurate serve."
    return WorkPoolCreate(name=POOL, type="process", base_job_template=template, description=description)
