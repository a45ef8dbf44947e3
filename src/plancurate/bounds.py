"""How large numbers in files and configurations may be, so that nothing overflows that works with them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, field_validator

LARGEST = 2**31 - 1  # fits any integer type on the way to the native code and the lake
LARGEST_LENGTH = 1e6  # m, rad, s: far beyond what a robot or a scene is made of

Finite = Annotated[float, Field(ge=-LARGEST_LENGTH, le=LARGEST_LENGTH, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
Seed = Annotated[int, Field(ge=0, le=LARGEST)]


class Settings(BaseModel):
    """Settings that a user may write: unknown fields are errors, and so are numbers that are absurdly large.

    A field says itself where less than `LARGEST` would be right.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    @field_validator("*")
    @classmethod
    def _fits(cls, value: Any) -> Any:
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, (int, float)) and not abs(number) <= LARGEST:
                raise ValueError(f"Input should be between -{LARGEST} and {LARGEST}")
        return value
