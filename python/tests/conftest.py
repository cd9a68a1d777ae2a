"""What several tests need."""

from __future__ import annotations

from typing import Any

import pytest

#: A short episode with strips enough that all slots are filled.
SHORT: dict[str, Any] = {"orbits": 0.3, "scenario": {"count": [1500, 1500]}}


@pytest.fixture
def short() -> dict[str, Any]:
    """Settings of a short episode."""
    return {"episode": SHORT}
