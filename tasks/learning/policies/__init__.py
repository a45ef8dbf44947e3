"""Behaviour-cloning policies, one kind a module, each registered by name when this package is imported."""

from __future__ import annotations

import importlib
import pkgutil

from plancurate.tasks.learning.policies.policy import POLICIES, Policy, make_policy, policy_names
from plancurate.tasks.learning.policies.trained import Normaliser, TrainedPolicy, load_policy

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")

__all__ = ["POLICIES", "Normaliser", "Policy", "TrainedPolicy", "load_policy", "make_policy", "policy_names"]
