"""The forms of the deployments: the schemas that Prefect makes of the flows, asked as its server asks them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from prefect import Flow
from prefect.exceptions import ParameterTypeError
from prefect.flows import load_flow_from_entrypoint
from prefect.utilities.schema_tools import validate

import plancurate
from plancurate.flows.forms import ALL
from plancurate.robots import robot_names, scene_names
from plancurate.tasks.candidates.sources import source_names
from plancurate.tasks.curation.selectors.base import selector_names
from plancurate.tasks.learning.observations import term_names
from plancurate.tasks.learning.policies import policy_names
from plancurate.tasks.study.config import StudyConfig, load_config, preset_names

FOLDER = Path(plancurate.__file__).parent
DEPLOYMENTS = {
    item["name"]: item for item in yaml.safe_load((FOLDER / "prefect.yaml").read_text())["deployments"]
}
OF_STUDIES = sorted(DEPLOYMENTS.keys() - {"predict"})


@pytest.fixture(scope="module")
def flows() -> dict[str, Flow[..., Any]]:
    return {
        name: load_flow_from_entrypoint(str(FOLDER / item["entrypoint"]), use_placeholder_flow=False)
        for name, item in DEPLOYMENTS.items()
    }


def form(flow: Flow[..., Any]) -> dict[str, Any]:
    return flow.parameters.model_dump()["properties"]


def leaves(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """All fields that can be filled in, those of settings within settings too."""
    for name, field in schema["properties"].items():
        if folded(field):
            yield from leaves(field["anyOf"][1])
        elif name != "preset":
            yield field


def folded(field: dict[str, Any]) -> bool:
    """Whether a field stands for settings that one asks for first."""
    return [choice.get("title") for choice in field.get("anyOf", ())] == ["As the preset", "Own"]


def test_there_is_a_deployment_for_every_stage() -> None:
    stages = {"study", "generate", "curate", "train", "refine", "evaluate", "report", "compact", "predict"}
    assert set(DEPLOYMENTS) == stages
    plans = {name: item["schedules"] for name, item in DEPLOYMENTS.items() if "schedules" in item}
    assert set(plans) == {"study", "compact"}
    assert not any(plan["active"] for (plan,) in plans.values())
    assert plans["study"][0]["parameters"] == {"grow": 5}


@pytest.mark.parametrize("name", OF_STUDIES)
def test_a_form_begins_with_the_preset_and_says_of_every_field_what_presets_have(
    flows: dict[str, Flow[..., Any]], name: str
) -> None:
    config = form(flows[name])["config"]
    preset, *fields = config["properties"]
    assert preset == "preset"
    assert set(config["properties"]["preset"]["enum"]) == set(preset_names())
    assert fields == [field for field in ALL if field in fields]
    for field in leaves(config):
        assert "default" not in field  # it would be sent, and lie over the preset's
        assert ". Default: " in field["description"]
        assert {"type": "null"} not in field.get("anyOf", ())
        assert "anyOf" not in field.get("items", ())  # Prefect shows such a list as an editor for JSON
    assert all(parameter["description"] for parameter in form(flows[name]).values())


def test_a_stage_asks_for_what_it_works_on_and_does_and_for_nothing_after_it(
    flows: dict[str, Flow[..., Any]],
) -> None:
    asked = {name: set(form(flows[name])["config"]["properties"]) for name in OF_STUDIES}
    assert asked["generate"] < asked["curate"] < asked["train"] < asked["refine"] < asked["evaluate"]
    assert not asked["generate"] & {"selectors", "budgets", "policies", "training", "evaluation", "unseen"}
    assert not asked["curate"] & {"policies", "training", "evaluation", "unseen"}
    assert not asked["train"] & {"corrections", "evaluation", "unseen"}
    assert asked["study"] == {"preset", *ALL}


def test_a_form_lists_what_is_registered(flows: dict[str, Flow[..., Any]]) -> None:
    fields = form(flows["study"])["config"]["properties"]
    assert fields["robot"]["anyOf"][0]["enum"] == robot_names()
    assert fields["scenes"]["anyOf"][0]["items"]["enum"] == scene_names()
    assert fields["planners"]["items"]["enum"] == source_names()
    assert fields["policies"]["items"]["enum"] == policy_names()
    assert fields["selectors"]["anyOf"][0]["items"]["enum"] == selector_names()
    assert folded(fields["training"])
    training = fields["training"]["anyOf"][1]["properties"]
    assert training["observation"]["items"]["enum"] == term_names()
    assert form(flows["predict"])["policy"]["anyOf"][0]["enum"] == policy_names()


@pytest.mark.parametrize(
    "wrong",
    [
        {"preset": "slow"},
        {"n_targets": 0},
        {"policies": ["BC_CNN"]},
        {"planners": []},
        {"selectors": ["Best"]},
        {"selectors": [{"name": "Best"}]},
        {"candidates": {"plan": {"runs": "many"}}},
        {"targets": 5},
    ],
    ids=str,
)
def test_a_form_refuses_wrong_input(flows: dict[str, Flow[..., Any]], wrong: dict[str, Any]) -> None:
    assert validate({"config": wrong}, flows["study"].parameters.model_dump())


def test_a_form_takes_files_and_parameters(flows: dict[str, Flow[..., Any]]) -> None:
    config = {
        "preset": "paper",
        "scenes": ["free", "my/shelf.yaml"],
        "robot": "my_arm",
        "selectors": ["General", {"name": "BehaviorRetrieval", "task": "shortest"}],
        "candidates": {"targets": None, "plan": {"runs": 1}},
    }
    schema = flows["study"].parameters.model_dump()
    assert validate({"config": config, "grow": 5, "grow_by": "runs"}, schema) == []
    assert validate({"config": config, "grow": -1}, schema)
    assert validate({"config": config, "grow": 5, "grow_by": "seeds"}, schema)


def test_what_is_filled_in_lies_over_the_preset(flows: dict[str, Flow[..., Any]]) -> None:
    def read(flow: str, config: object) -> StudyConfig:
        return flows[flow].validate_parameters({"config": config})["config"]

    given = {
        "preset": "paper",
        "n_targets": 3,
        "workers": None,
        "candidates": {"plan": {"runs": 1, "seed": None}},
    }
    expected = {"n_targets": 3, "candidates": {"plan": {"runs": 1}}}
    assert read("generate", given) == load_config("paper", None, expected)
    assert read("study", {}) == load_config("quick", None, {})
    whole = load_config("smoke", None, {"name": "mine"})
    assert read("train", whole) == whole


def test_what_the_schema_cannot_say_is_refused_by_the_configuration(flows: dict[str, Flow[..., Any]]) -> None:
    with pytest.raises(ParameterTypeError, match="names a value twice"):
        flows["study"].validate_parameters({"config": {"seeds": [1, 1]}})
