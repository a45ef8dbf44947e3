"""Read YAML files; whatever is wrong with one becomes a line that names it."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from plancurate.errors import PlancurateError


class _Loader(yaml.SafeLoader):
    """Plain values only, and no key twice: of two, the first would be lost without a word."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Build a mapping; a key given twice is an error."""
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                twice = f"key '{key.value}' is given twice"
                raise yaml.constructor.ConstructorError(None, None, twice, key.start_mark)
            seen.add(key.value if isinstance(key, yaml.ScalarNode) else key)
        return super().construct_mapping(node, deep)


def read_yaml(file: Path) -> Any:
    """Return what a YAML file holds; PlancurateError for one that can't be read or isn't YAML."""
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise PlancurateError(
            f"{file}: cannot be read: {error.strerror}; give a readable YAML file"
        ) from None
    except UnicodeDecodeError as error:
        raise PlancurateError(f"{file}: not UTF-8 at byte {error.start}; save it as UTF-8") from None
    return parse_yaml(text, file)


def parse_yaml(text: str, source: object) -> Any:
    """Return what YAML text holds; PlancurateError that names its source for anything else."""
    try:
        return yaml.load(text, _Loader)
    except RecursionError:
        raise PlancurateError(f"{source}: nests too deep; a few levels would be right") from None
    except (yaml.YAMLError, ValueError) as error:  # ValueError: a date that there never was
        raise PlancurateError(f"{source}: not valid YAML: {' '.join(str(error).split())}") from None


def read_mapping(file: Path) -> dict[str, Any]:
    """Return the mapping that a YAML file holds; PlancurateError if it holds anything else."""
    values = read_yaml(file)
    if not isinstance(values, dict):
        kind = "nothing" if values is None else f"a {type(values).__name__}"
        raise PlancurateError(f"{file}: holds {kind}, a mapping of fields would be right")
    return values


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Return base with over's values put in, mapping by mapping."""
    result = dict(base)
    for name, value in over.items():
        both = isinstance(value, dict) and isinstance(result.get(name), dict)
        result[name] = merged(result[name], value) if both else value
    return result
