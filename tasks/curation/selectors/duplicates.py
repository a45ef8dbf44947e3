"""Chunks of motion that another candidate to the same target shows already: the deduplication of SCIZOR."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plancurate.tasks.curation.selectors.base import IntArray
from plancurate.tasks.curation.selectors.progress import WINDOW, Clocked
from plancurate.tasks.curation.selectors.windows import Mask
from plancurate.tasks.learning.demonstrations import Float32Array

FRAMES = 8
STATE_WEIGHT = 0.8  # of the cosine of states; the rest is that of actions


@dataclass(frozen=True, eq=False)
class Chunks:
    """Motions of all candidates cut into equal parts of about WINDOW, one after another."""

    embedding: Float32Array
    """(chunks, e): products are cosines."""
    candidate: IntArray
    """(chunks,): candidate that each is of."""
    of_step: IntArray
    """(steps,): chunk that each step lies in."""


def cut(clocked: Clocked, actions: Float32Array) -> Chunks:
    """Cut candidates into chunks; `actions` (steps, n) are standardised as the states are."""
    counts = np.maximum(1, np.round(clocked.duration / WINDOW)).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    candidate = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(candidate)) - first[candidate]
    share = (number[:, None] + (np.arange(FRAMES) + 0.5) / FRAMES) / counts[candidate, None]
    time = (share * clocked.duration[candidate, None]).ravel()
    frames = np.repeat(candidate, FRAMES)
    moves = Clocked(actions, clocked.starts, clocked.lengths, clocked.step)
    states = unit_rows(clocked.at(frames, time).reshape(len(candidate), -1)) * STATE_WEIGHT**0.5
    acts = unit_rows(moves.at(frames, time).reshape(len(candidate), -1)) * (1 - STATE_WEIGHT) ** 0.5
    step_of = np.repeat(np.arange(len(counts)), clocked.lengths)
    step = np.arange(len(step_of)) - clocked.starts[step_of]
    within = step * counts[step_of] // clocked.lengths[step_of]
    return Chunks(np.concatenate([states, acts], axis=1), candidate, first[step_of] + within)


def unit_rows(rows: Float32Array) -> Float32Array:
    """Rows (k, e) less their mean and of length 1: uncentred, all postures near home are alike."""
    centred = rows - rows.mean(axis=0)
    return np.asarray(centred / np.maximum(np.linalg.norm(centred, axis=1, keepdims=True), 1e-9))


def duplicated(chunks: Chunks, target: IntArray, similarity: float) -> Mask:
    """Chunks (chunks,) whose cosine with one of an earlier candidate to the same target is above `similarity`.

    All pairs are compared; the method's own clusters only save time. Motions to two targets never are
    duplicates, and of several alike the first remains. `target` is (candidates,).
    """
    found = np.zeros(len(chunks.candidate), dtype=bool)
    for number in np.unique(target):
        rows = np.flatnonzero(target[chunks.candidate] == number)
        cosine = chunks.embedding[rows] @ chunks.embedding[rows].T
        earlier = chunks.candidate[rows][None, :] < chunks.candidate[rows][:, None]
        found[rows] = ((cosine > similarity) & earlier).any(axis=1)
    return found


def whole_duplicates(chunks: Chunks, repeated: Mask, candidates: int) -> Mask:
    """Candidates (candidates,) all of whose chunks are repeated (chunks,)."""
    return np.asarray(np.bincount(chunks.candidate[~repeated], minlength=candidates) == 0)
