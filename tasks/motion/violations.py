"""What is wrong with a motion, and the verdict on it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Check = Literal[
    "shape", "joint order", "finite", "times", "position", "velocity", "acceleration", "jerk",
    "self-collision", "scene collision", "clearance", "torque", "tracking", "contact", "saturation",
]  # fmt: skip


@dataclass(frozen=True)
class Violation:
    """One thing that a motion does and must not; `worst` and `limit` are null where there is no measure."""

    check: Check
    time_s: float
    """When it happens first; the start of the motion for what concerns all of it."""
    where: str
    """A joint, or two things that touch; empty where it is the whole motion."""
    message: str
    """What, in words."""
    worst: float | None = None
    limit: float | None = None
    unit: str = ""

    @property
    def sentence(self) -> str:
        """All of it for a person."""
        return f"{self.message}, first at {self.time_s:.3f} s"


@dataclass(frozen=True)
class Verdict:
    """Whether a motion may run: `violations` in order of time, and what could not be checked."""

    violations: tuple[Violation, ...]
    not_checked: tuple[str, ...]
    measured: dict[str, float]
    """Duration (s), samples, peaks as shares of the limits, least clearance (m), tracking errors."""

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.violations

    @property
    def first(self) -> Violation | None:
        """What is wrong first."""
        return self.violations[0] if self.violations else None

    @property
    def text(self) -> str:
        """The verdict, what is wrong, what was measured and what was not checked, a line each."""
        first = self.first
        lines = ["PASS" if first is None else f"FAIL: {first.sentence}"]
        lines += [f"  also: {violation.sentence}" for violation in self.violations[1:]]
        lines += [f"  {name}: {value:.4g}" for name, value in self.measured.items()]
        lines += [f"  not checked: {what}" for what in self.not_checked]
        return "\n".join(lines)

    def as_record(self) -> dict[str, Any]:
        """Everything as plain data."""
        return {
            "passed": self.passed,
            "first": asdict(self.first) if self.first else None,
            "violations": [asdict(violation) for violation in self.violations],
            "not_checked": list(self.not_checked),
            "measured": self.measured,
        }


def verdict(
    violations: list[Violation], not_checked: tuple[str, ...] = (), measured: dict[str, float] | None = None
) -> Verdict:
    """The verdict with what happens first in front."""
    ordered = sorted(violations, key=lambda violation: violation.time_s)
    return Verdict(tuple(ordered), not_checked, measured or {})
