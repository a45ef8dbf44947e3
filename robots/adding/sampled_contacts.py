"""Which pairs of a robot's links never meet, or always touch, found by drawing states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate import native
from plancurate.robots.adding.model import Model
from plancurate.robots.scene import empty_scene
from plancurate.robots.shapes import FloatArray

DRAWS = 20_000
NEAREST, ROUNDS = 50, 40  # states that are led closer, and steps of each
LEAST_CLEARANCE = 0.01  # share of the arm's length that a pair which never meets keeps
OFTEN = 0.3  # share of drawn states in which a pair touches that is worth a word


@dataclass(frozen=True)
class PairContact:
    """Two links: share of drawn states in which they touch; the least clearance found where they never do, m."""

    links: tuple[str, str]
    touching: float
    least_clearance: float

    @property
    def always(self) -> bool:
        """Whether they touched in every state."""
        return self.touching == 1.0

    @property
    def often(self) -> bool:
        """Whether they touch so often that a person should know."""
        return self.touching > OFTEN

    @property
    def sentence(self) -> str:
        """How often they touch, in words."""
        first, second = self.links
        return f"'{first}' and '{second}' touch in {self.touching:.0%} of drawn states"


def sample_contacts(model: Model) -> list[PairContact]:
    """Look at all pairs of links that are not neighbours."""
    states = model.draw(DRAWS, seed=0)
    return [_look_at(model, pair, states) for pair in model.unrelated_pairs()]


def never_meets(contact: PairContact, length: float) -> bool:
    """Whether the search for a state in which the links come near each other found none; `length` is the arm's, m."""
    return contact.touching == 0.0 and contact.least_clearance > LEAST_CLEARANCE * length


def _look_at(model: Model, pair: tuple[str, str], states: FloatArray) -> PairContact:
    robot, alone = model.of_links(*pair), empty_scene().native
    touching = float(1.0 - native.is_free(robot, alone, states).mean())
    if touching > 0.0:
        return PairContact(pair, touching, 0.0)
    return PairContact(pair, 0.0, _closest(model, robot, states))


def _closest(model: Model, robot: native.Robot, states: FloatArray) -> float:
    """Least clearance, m, that the states nearest to a contact come to when they are led closer."""
    alone, rng = empty_scene().native, np.random.default_rng(1)
    clearance = native.clearance(robot, alone, states)
    order = clearance.argsort()[:NEAREST]
    best, least = states[order], clearance[order]
    for spread in np.geomspace(0.3, 0.01, ROUNDS):
        step = rng.normal(size=best.shape) * spread * np.minimum(model.upper - model.lower, 2 * np.pi)
        tried = np.clip(best + step, model.lower, model.upper)
        found = native.clearance(robot, alone, tried)
        best = np.where((found < least)[:, None], tried, best)
        least = np.minimum(found, least)
    return float(least.min())
