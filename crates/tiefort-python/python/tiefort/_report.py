"""What a build found: a typed view of ``report.json``."""

from __future__ import annotations

import json
from typing import Any

from ._mesh import Residual


def residual_of(figures: dict[str, Any]) -> Residual:
    """Figures of residuals by name."""
    names = ("rms_m", "max_m", "mean_abs_m", "p95_m", "p99_m")
    return Residual(**{name: figures[name] for name in names if name in figures})


class Report:
    """What a build found.

    Attributes
    ----------
    raw : dict
        All of ``report.json``; ``docs/reference`` says what its keys mean.
    """

    def __init__(
        self, text: str, *, rebuilt: int | None = None, kept: int | None = None, unchanged: bool = False
    ) -> None:
        self.raw: dict[str, Any] = json.loads(text)
        self._rebuilt = rebuilt
        self._kept = kept
        self._unchanged = unchanged

    def __repr__(self) -> str:
        rms = f"RMS {self.residual.rms_m:.3f} m"
        return f"Report({self.area!r}, {self.triangles} triangles, {rms}, {len(self.breaches)} breaches)"

    @property
    def area(self) -> str:
        """Name of the area."""
        return str(self.raw["area"])

    @property
    def triangles(self) -> int:
        """Triangles of all load modules."""
        return int(self.raw["triangles"])

    @property
    def polygons(self) -> int:
        """Convex polygons of all load modules."""
        return int(self.raw["polygons"])

    @property
    def points(self) -> int:
        """Points of the area."""
        return int(self.raw["points"]["total"])

    @property
    def residual(self) -> Residual:
        """Against every post of the working grid, in metres."""
        return residual_of(self.raw["residual"])

    @property
    def per_load_module(self) -> dict[str, Any]:
        """Use of the limit of a load module: mean, max, limit, over."""
        return dict(self.raw["per_load_module"])

    @property
    def per_4km(self) -> dict[str, Any]:
        """Use of the limit of a square of 4 km: max, limit, over."""
        return dict(self.raw["per_4km"])

    @property
    def breaches(self) -> list[dict[str, Any]]:
        """Limits that could not be met, each with its place, its count and the limit."""
        return list(self.raw["breaches"])

    @property
    def warnings(self) -> list[str]:
        """What else a person should know, a sentence each."""
        return list(self.raw["warnings"])

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds on the clock by stage."""
        return {stage["name"]: float(stage["wall_s"]) for stage in self.raw["stages"]}

    @property
    def ok(self) -> bool:
        """Whether all limits are met."""
        return not self.breaches

    @property
    def tiles_rebuilt(self) -> int | None:
        """Tiles that this build refined; None for a report that was read."""
        return self._rebuilt

    @property
    def tiles_kept(self) -> int | None:
        """Tiles that were fresh; None for a report that was read."""
        return self._kept

    @property
    def unchanged(self) -> bool:
        """Whether nothing had to be done."""
        return self._unchanged
