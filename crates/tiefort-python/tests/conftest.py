"""What tests share: ground, and a small database."""

from __future__ import annotations

import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiefort

JOB: dict[str, Any] = {
    "area": {
        "name": "small",
        "crs": "EPSG:32611",
        "origin_m": [505_000, 3_875_000],
        "size_m": [4000, 3000],
        "spacing_m": 25,
    },
    "dem": {"source": "sample"},
    "tiles": {"rows": 2, "columns": 2},
}


def hills(rows: int = 120, cols: int = 160, dtype: Any = np.float32) -> np.ndarray[Any, Any]:
    """Ground that is smooth, with a step in it."""
    row, col = np.mgrid[0:rows, 0:cols]
    ground = 100 + 60 * np.sin(row / 17) * np.cos(col / 23) + np.where(80 < col, 30, 0)
    return ground.astype(dtype)


def command() -> str:
    """Return the command that was installed beside the package."""
    return str(Path(sysconfig.get_path("scripts")) / "tiefort")


def run(*words: Any, **more: Any) -> subprocess.CompletedProcess[str]:
    """Run the command."""
    return subprocess.run([command(), *map(str, words)], capture_output=True, text=True, timeout=300, **more)


@pytest.fixture(scope="session")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("databases") / "small.tdb"
    tiefort.build(JOB, out, workers=2)
    return out
