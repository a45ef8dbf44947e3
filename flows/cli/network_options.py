"""Options that say which network of a study is meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cyclopts import Parameter

if TYPE_CHECKING:
    from plancurate.tasks.study.predictor import Choice


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class NetworkOptions:
    """Which network of a study; what is left out is the study's best."""

    study: str
    """Name of the study; the one that ran last under it."""
    key: str | None = None
    """Key of an earlier study of that name."""
    scene: str | None = None
    """The study's scene, where it has several."""
    selector: str | None = None
    """Selector that the policy learnt from [default: the study's best]."""
    policy: str | None = None
    """Policy [default: the selector's best]."""

    def choice(self) -> Choice:
        """Return what the options name."""
        from plancurate.tasks.study.predictor import Choice  # torch and SciPy: no --help needs them

        return Choice(self.study, self.key, self.scene, self.selector, self.policy)
