"""The forms on Prefect's pages: a preset, and fields over it; of a stage those that decide what it works on and does.

A form is the JSON schema of a flow's parameter `config`. Every field may stay empty, which means what the preset says;
so no field has a default of its own, and its sentence names what each preset says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from plancurate.flows.cli.fields import default_text
from plancurate.tasks.study.config import StudyConfig, load_config, preset_names, preset_values
from plancurate.yaml_files import merged

PRESET = "quick"
POOL = (
    "name", "robot", "scenes", "n_targets", "planners", "candidates", "pools",
    "workers", "targets_per_task", "runner", "dask_scheduler", "ray_address",
)  # fmt: skip
SELECTIONS = (*POOL, "selectors", "budgets", "selection_seeds")
NETWORKS = (*SELECTIONS, "policies", "one_policy_a", "seeds", "training", "varying_observation")
CORRECTED = (*NETWORKS, "corrections", "evaluation")
ALL = tuple(StudyConfig.model_fields)


@dataclass(frozen=True)
class Form:
    """What a parameter of type StudyConfig looks like on a page: these fields of it, in the configuration's order."""

    fields: tuple[str, ...]

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """Return the form's schema, in which nothing refers to anything outside."""
        whole = whole_form()
        chosen = {name: whole[name] for name in ("preset", *StudyConfig.model_fields) if name in self.fields}
        return {
            "type": "object",
            "title": "Study",
            "properties": {"preset": whole["preset"], **chosen},
            "additionalProperties": False,
        }


def over_preset(value: object) -> object:
    """Return what a form gives as fields of a configuration: those filled in over the preset's."""
    if not isinstance(value, Mapping):
        return value
    filled = without_empty(value)
    return merged(preset_values(filled.pop("preset", PRESET)), filled)


def without_empty(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that were filled in, those of settings within settings too."""
    return {
        name: without_empty(value) if isinstance(value, Mapping) else value
        for name, value in values.items()
        if value is not None
    }


PoolConfig = Annotated[StudyConfig, BeforeValidator(over_preset), Form(POOL)]
SelectionsConfig = Annotated[StudyConfig, BeforeValidator(over_preset), Form(SELECTIONS)]
NetworksConfig = Annotated[StudyConfig, BeforeValidator(over_preset), Form(NETWORKS)]
CorrectedConfig = Annotated[StudyConfig, BeforeValidator(over_preset), Form(CORRECTED)]
WholeConfig = Annotated[StudyConfig, BeforeValidator(over_preset), Form(ALL)]


@cache
def whole_form() -> dict[str, JsonSchemaValue]:
    """Schemas of the preset and of all fields by name."""
    schema = StudyConfig.model_json_schema()
    presets = {name: load_config(name, None, {}) for name in preset_names()}
    fields = inlined(schema["properties"], schema["$defs"])
    said = {
        "title": "preset",
        "type": "string",
        "enum": [PRESET, *(name for name in presets if name != PRESET)],
        "default": PRESET,
        "description": "What every field is that stays empty below.",
    }
    return {"preset": said, **{name: described(field, name, presets) for name, field in fields.items()}}


def inlined(schema: Any, definitions: Mapping[str, Any]) -> Any:
    """Return a schema with the definitions that it refers to in their places."""
    if isinstance(schema, list):
        return [inlined(item, definitions) for item in schema]
    if not isinstance(schema, Mapping):
        return schema
    if "$ref" in schema:
        own = {name: value for name, value in schema.items() if name != "$ref"}
        return inlined({**definitions[schema["$ref"].rpartition("/")[2]], **own}, definitions)
    return {name: inlined(value, definitions) for name, value in schema.items()}


def described(field: JsonSchemaValue, name: str, presets: Mapping[str, BaseModel]) -> JsonSchemaValue:
    """Return a field without a default; its sentence, and those of fields within, name what presets say.

    It is called as in configuration files and options.
    """
    values = {preset: getattr(config, name) for preset, config in presets.items()}
    text = sentence(field["description"])
    if isinstance(values[PRESET], BaseModel):
        inner = {key: described(value, key, values) for key, value in field["properties"].items()}
        return {"title": name, "description": text, **folded(inner)}
    kept = choice_of_lists(without_null({key: value for key, value in field.items() if key != "default"}))
    return kept | {"title": name, "description": f"{text} {said_by(values)}"}


def folded(fields: Mapping[str, JsonSchemaValue]) -> JsonSchemaValue:
    """Return settings whose fields are shown once a person asks for them: all unfolded, a form is ten screens long.

    Prefect's form says nothing of a wrong field within a choice and doesn't send it. So what it goes by has no bounds,
    and what its server goes by has them.
    """
    own = {"type": "object", "title": "Own", "properties": fields, "additionalProperties": False}
    choices = [{"type": "null", "title": "As the preset"}, shown(own)]
    return {"anyOf": choices, "if": {"type": "object"}, "then": own}


def shown(schema: JsonSchemaValue) -> JsonSchemaValue:
    """Return of a schema what decides how a form shows it, so that everything that can be entered there is right."""
    kept: JsonSchemaValue = {
        key: schema[key] for key in ("title", "description", "type", "enum") if key in schema
    }
    if kept.get("type") == "integer":
        kept["type"] = "number"
    if "properties" in schema:
        kept["properties"] = {name: shown(field) for name, field in schema["properties"].items()}
    elif kept.get("type") == "object":
        del kept["type"]  # an editor for JSON, whatever it holds
    if "anyOf" in schema:
        kept["anyOf"] = [shown(choice) for choice in schema["anyOf"]]
    if items := schema.get("items") or schema.get("prefixItems", [None])[0]:
        kept["items"] = shown(items)
    return kept


def without_null(field: JsonSchemaValue) -> JsonSchemaValue:
    """Return a field without the choice of null, which an empty field is anyway."""
    choices = [choice for choice in field.get("anyOf", ()) if choice != {"type": "null"}]
    return (
        {key: value for key, value in field.items() if key != "anyOf"} | choices[0]
        if len(choices) == 1
        else field
    )


def choice_of_lists(field: JsonSchemaValue) -> JsonSchemaValue:
    """Return a list whose items are registered names or something else as a choice between two lists.

    Prefect's form has an editor for JSON where each item is a choice; names alone it offers to be picked.
    """
    items = field.get("items", {})
    if "anyOf" not in items:
        return field
    registered, other = items["anyOf"]
    takes_all = other if other["type"] == "string" else items
    lists = [
        field | {"title": choice["title"], "items": own}
        for choice, own in ((registered, registered), (other, takes_all))
    ]
    return {"anyOf": lists}


def sentence(text: str) -> str:
    """Return a description as a sentence."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def said_by(values: Mapping[str, object]) -> str:
    """Say what the presets have for a field, the same of several once."""
    names: dict[str, list[str]] = {}
    for preset, value in values.items():
        names.setdefault(default_text(value), []).append(preset)
    if len(names) == 1:
        return sentence(f"Default: {next(iter(names))}")
    if all([text] == who for text, who in names.items()):
        return "Default: the preset's own."
    by_value = "; ".join(f"{text} ({', '.join(who)})" for text, who in names.items())
    return f"Default: {by_value}."
