"""Where networks run."""

from __future__ import annotations

import torch

from plancurate.errors import PlancurateError


def usable(device: str) -> torch.device:
    """The device of that name; raises PlancurateError when this machine or PyTorch build lacks it."""
    try:
        return torch.zeros(1, device=device).device
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise PlancurateError(f"device: '{device}' can't be used ({reason}); 'cpu' always can") from None
