"""Behaviour-cloning policies, one kind a module, each registered by name when a policy is first looked up.

A policy of another package names its module as an entry point of the group `plancurate.policies`.
"""

from __future__ import annotations

from plancurate.tasks.learning.policies.policy import Policy, kind_of, make_policy, policy_names, register
from plancurate.tasks.learning.policies.trained import Normaliser, TrainedPolicy, load_policy

__all__ = [
    "Normaliser", "Policy", "TrainedPolicy", "kind_of", "load_policy", "make_policy", "policy_names", "register",
]  # fmt: skip
