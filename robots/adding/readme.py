"""The README of an added robot: where it comes from, what was decided, how well its shapes fit."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from plancurate.robots.adding.folding import Folded
from plancurate.robots.adding.quality import FitQuality


def readme_text(
    name: str, urdf: Path, folded: Folded, quality: Sequence[FitQuality], notes: Sequence[str]
) -> str:
    """Return the Markdown page."""
    digest = hashlib.sha256(urdf.read_bytes()).hexdigest()
    held = ", ".join(f"`{joint}` at {value:g}" for joint, value in folded.held.items()) or "none"
    lines = [
        f"# {name}",
        "",
        f"Made by `plancurate robots add` from `{urdf.name}` (SHA-256 {digest[:16]}). Joint origins, axes, limits and",
        "masses are that file's; no mesh of it is here.",
        "",
        f"Joints that move: {', '.join(f'`{joint.name}`' for joint in folded.moving)}. Joints that are held: {held}.",
        "",
        "## Shapes",
        "",
        "Every mesh lies inside the primitives; `fit.png` shows both.",
        "",
        "| link | shapes | inside | sticks out in the mean | at most |",
        "|---|---|---|---|---|",
        *(_row(fit) for fit in quality),
    ]
    if notes:
        lines += ["", "## Decided", "", *(f"- {note}" for note in notes)]
    return "\n".join(lines) + "\n"


def _row(fit: FitQuality) -> str:
    shapes = shapes_of(fit)
    return (
        f"| {fit.link} | {shapes} | {fit.coverage:.2%} | {1000 * fit.mean_protrusion:.1f} mm"
        f" | {1000 * fit.most_protrusion:.1f} mm |"
    )


def shapes_of(fit: FitQuality) -> str:
    """How many shapes of which kind, for a person."""
    plural = {"box": "boxes", "sphere": "spheres", "cylinder": "cylinders", "capsule": "capsules"}
    return ", ".join(
        f"{count} {kind if count == 1 else plural[kind]}"
        for kind, count in sorted(Counter(fit.kinds).items())
    )
