"""Types of numbers in files and configurations: how large each may be, so that nothing overflows behind it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

LARGEST = 1e6  # m, rad, s, kg: beyond what any robot, scene or study is made of

Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Share = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=1_000_000_000)]
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]
