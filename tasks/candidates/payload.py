"""What the tool carries."""

from __future__ import annotations

from pydantic import Field

from plancurate.bounds import Finite, Settings


class Payload(Settings):
    """A point mass at the tool."""

    mass_kg: float = Field(gt=0, le=1e5, description="mass, kg")
    centre_m: tuple[Finite, Finite, Finite] = Field(
        (0.0, 0.0, 0.0), description="centre of mass in the tool's frame, m"
    )
