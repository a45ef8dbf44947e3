"""The options of a study are the fields of its configuration, over those of the preset and of the file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import BaseModel

from plancurate.flows.cli.app import app, as_json, gathered, main
from plancurate.flows.cli.fields import leaves
from plancurate.flows.cli.study_options import ALIASES, StudyOptions, is_model
from plancurate.tasks.learning.policies import policy_names
from plancurate.tasks.study.config import StudyConfig

DEFAULTS = {name: value for name, value, _ in leaves(StudyConfig())}


def configured(*words: str) -> StudyConfig:
    """Return the configuration that `plancurate generate` runs with these options."""
    tokens = gathered(["generate", *map(as_json, words)])
    _, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
    return bound.arguments.get("options", StudyOptions()).study()


def value_of(config: BaseModel, name: str) -> Any:
    """Return a dotted field's value."""
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part)
    return value


def as_words(value: Any) -> list[str]:
    """Return a value as a person types it."""
    if isinstance(value, list):
        return [word for item in value for word in as_words(item)]
    return ["null"] if value is None else [value if isinstance(value, str) else json.dumps(value)]


def test_defaults_are_what_the_model_would_accept() -> None:
    assert StudyConfig.model_validate(StudyConfig().model_dump(mode="json")) == StudyConfig()
    assert set(StudyConfig().policies) == set(policy_names())


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, value in DEFAULTS.items() if value != ()])
def test_every_field_can_be_given_and_means_the_same(name: str) -> None:
    default = value_of(StudyConfig(), name)
    plain = StudyConfig().model_dump(mode="json")
    for part in name.split("."):
        plain = plain.get(part, default)  # a payload that there is not is not written
    words = as_words(plain)
    for option in (f"--{name}", f"--{name.replace('_', '-')}"):
        assert value_of(configured("--preset", "smoke", option, *words), name) == default


def test_the_help_shows_every_field_with_its_description(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["study", "--help"])
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    shown = {
        name: field for name, field in StudyConfig.model_fields.items() if not is_model(field.annotation)
    }
    assert {"name", "planners", "budgets"} <= set(shown) < set(StudyConfig.model_fields)
    for name, field in shown.items():
        assert f"--{name.replace('_', '-')} " in said
        assert field.description
        assert " ".join(field.description.split()[:3]) in said


def test_fields_lists_all_that_can_be_set(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fields"])
    said = capsys.readouterr().out
    assert len(DEFAULTS) > len(StudyConfig.model_fields)
    for name in DEFAULTS:
        assert f"{name} = " in said
    assert "candidates.plan.runs = 3" in said


def test_an_option_goes_over_the_file_and_the_file_over_the_preset(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    settings = {"plan": {"runs": 4, "seed": 5}, "targets": {"seed": 6}}
    file.write_text(yaml.safe_dump({"seeds": [7], "unseen": 8, "candidates": settings}))
    config = configured(
        "--preset", "paper", "--config", str(file), "--unseen", "9", "--candidates.plan.seed", "0"
    )
    assert (config.n_targets, config.seeds, config.unseen) == (64, (7,), 9)  # preset, file, option
    plan = config.candidates.plan
    # An option of the default's own value counts as given, and what lies beside it in the file stays.
    assert (plan.runs, plan.seed, config.candidates.targets.seed) == (4, 0, 6)


def test_nothing_given_is_the_preset_itself() -> None:
    assert configured("--preset", "paper").n_targets == 64
    assert configured() == configured("--preset", "quick")


@pytest.mark.parametrize(
    ("words", "field", "value"),
    [
        (["--targets", "7"], "n_targets", 7),
        (["--scene", "free", "table"], "scenes", ("free", "table")),
        (["--planners", "RRT", "PRM", "--workers", "3"], "planners", ("RRT", "PRM")),
        (["--seeds", "[3, 4]"], "seeds", (3, 4)),
        (["--candidates", "{plan: {runs: 4}}"], "candidates.plan.runs", 4),
        (
            ["--candidates.plan.params", "{RRT: {range: '3'}}"],
            "candidates.plan.params",
            {"RRT": {"range": "3"}},
        ),
        (["--candidates.plan.params.RRT.range", "3"], "candidates.plan.params", {"RRT": {"range": "3"}}),
        (["--pools", "{a-b: {plan: {runs: 4}}}"], "pools", {"a-b": {"plan": {"runs": 4}}}),
        (["--pools.a-b.plan.runs", "4"], "pools", {"a-b": {"plan": {"runs": "4"}}}),
        (["--dask-scheduler", "null"], "dask_scheduler", None),
    ],
)
def test_what_is_given_arrives(words: list[str], field: str, value: object) -> None:
    assert value_of(configured(*words), field) == value


def test_a_selector_takes_parameters() -> None:
    chosen = configured("--selectors", "General", "{name: BehaviorRetrieval, task: shortest}").selectors
    assert [(choice.name, choice.params) for choice in chosen] == [
        ("General", {}), ("BehaviorRetrieval", {"task": "shortest"}),
    ]  # fmt: skip


def test_aliases_are_fields_of_the_study() -> None:
    assert set(ALIASES) <= set(StudyConfig.model_fields)
