"""Batches of standardised windows for many networks, each from its own data by its own random generator."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from plancurate.tasks.learning.demonstrations import Demonstrations
from plancurate.tasks.learning.policies.policy import Policy
from plancurate.tasks.learning.policies.trained import Normaliser
from plancurate.tasks.learning.settings import Action

BLOCK = 50
"""Gradient steps whose windows and masks are drawn at once."""


def generator(policy: str, seed: int, purpose: str) -> torch.Generator:
    """A random generator of its own for each policy, seed and purpose."""
    digest = hashlib.sha256(f"{policy}/{seed}/{purpose}".encode()).digest()
    return torch.Generator().manual_seed(int.from_bytes(digest[:8], "little"))


def normaliser(data: Demonstrations, action: Action) -> Normaliser:
    """Mean and scale of observations and actions; the guard keeps a joint that never moves at its place."""
    observations = torch.from_numpy(data.observations).double()
    actions = _actions(data, action).double()
    return Normaliser(
        observation_mean=observations.mean(0).float(),
        observation_scale=(observations.std(0, correction=0) + 1e-3).float(),
        action_mean=actions.mean(0).float(),
        action_scale=(actions.std(0, correction=0) + 1e-3).float(),
    )


def _actions(data: Demonstrations, action: Action) -> Tensor:
    steps = torch.from_numpy(data.actions)
    return steps if action == "delta" else steps + torch.from_numpy(data.q)


class Batches:
    """Standardised windows for S networks, each drawn by its own generator from its own data."""

    def __init__(
        self,
        kind: Policy,
        data: Sequence[Demonstrations],
        normalisers: Sequence[Normaliser],
        seeds: Sequence[int],
        action: Action,
        window: int,
        device: torch.device,
    ) -> None:
        self.kind, self.data, self.device = kind, data, device
        self.length = window if kind.recurrent else 1
        self.rngs = [generator(kind.name, seed, "batches") for seed in seeds]
        tables: dict[int, tuple[int, Tensor]] = {}
        begin = 0
        for d, norm in zip(data, normalisers, strict=True):
            if id(d) not in tables:
                tables[id(d)] = (begin, standardised(d, norm, action))
                begin += len(d.observations)
        self.table = torch.cat([table for _, table in tables.values()]).to(self.device)
        self.offsets = [tables[id(d)][0] for d in data]
        self.block: list[tuple[Tensor, Tensor | None]] = []

    def next(self) -> tuple[Tensor, Tensor, Tensor | None]:
        """Observations (S, window, batch, o), actions (S, window, batch, n) and masks of one step."""
        if not self.block:
            self.block = self._draw()
        rows, masks = self.block.pop()
        windows = self.table[rows]
        observed = self.data[0].observations.shape[1]
        return windows[..., :observed], windows[..., observed:], masks

    def _draw(self) -> list[tuple[Tensor, Tensor | None]]:
        drawn = [self._draw_one(s) for s in range(len(self.data))]
        rows = torch.stack([rows for rows, _ in drawn], dim=1).to(self.device)
        masks = [m for _, m in drawn if m is not None]
        if not masks:
            return [(r, None) for r in rows]
        return list(zip(rows, torch.stack(masks, dim=1).to(self.device), strict=True))

    def _draw_one(self, s: int) -> tuple[Tensor, Tensor | None]:
        """Table rows (BLOCK, window, batch) and masks (BLOCK, batch, ...) of one network."""
        data = self.data[s]
        rows = data.windows(data.window_starts[self._draw_windows(s)], self.length) + self.offsets[s]
        rows = rows.reshape(BLOCK, self.kind.batch, self.length).swapaxes(1, 2)
        return torch.from_numpy(rows), self.kind.masks(BLOCK, data.observations.shape[1], self.rngs[s])

    def _draw_windows(self, s: int) -> npt.NDArray[np.int64]:
        """Numbers (BLOCK * batch,) of the windows that one network learns from next."""
        count, weights, rng = BLOCK * self.kind.batch, self.data[s].window_weights, self.rngs[s]
        if weights is None:
            return np.asarray(torch.randint(len(self.data[s].window_starts), (count,), generator=rng))
        total = np.cumsum(weights)
        drawn = torch.rand(count, generator=rng, dtype=torch.float64).numpy() * total[-1]
        return np.asarray(np.searchsorted(total, drawn, side="right"))


def standardised(data: Demonstrations, norm: Normaliser, action: Action) -> Tensor:
    """Table (steps, o + n) of standardised observations and actions."""
    observations = (torch.from_numpy(data.observations) - norm.observation_mean) / norm.observation_scale
    actions = (_actions(data, action) - norm.action_mean) / norm.action_scale
    return torch.cat([observations, actions], dim=1)
