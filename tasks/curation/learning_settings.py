"""What a study says of training, rollouts and timing, for selectors that do these things themselves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from plancurate.tasks.candidates.settings import TimingSettings
    from plancurate.tasks.learning.settings import EvaluateSettings, TrainSettings

Used = Literal["training", "evaluation", "timing"]


@dataclass(frozen=True)
class LearningSettings:
    """A study's own settings; a selector names those that it reads in `uses`."""

    training: TrainSettings
    evaluation: EvaluateSettings
    timing: TimingSettings

    def identity(self, uses: Iterable[Used]) -> dict[str, object]:
        """The named settings as plain data, without the device: it decides how fast, not what comes out."""
        return {name: getattr(self, name).model_dump(mode="json", exclude={"device"}) for name in uses}
