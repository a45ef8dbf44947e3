"""What names stand for: a hash of everything that decides a content, in its canonical JSON form."""

from __future__ import annotations

import hashlib
import json


def digest(content: object, length: int = 12) -> str:
    """Return hexadecimal digits that stand for `content`, which is made of what JSON knows."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:length]
