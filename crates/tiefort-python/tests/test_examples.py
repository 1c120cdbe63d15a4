"""The notebook and the examples run from top to bottom."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def test_the_notebook_runs_from_top_to_bottom(tmp_path: Path) -> None:
    notebook = json.loads((EXAMPLES / "terrain.ipynb").read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert 8 < len(cells)
    head = "import os\nos.environ.setdefault('MPLBACKEND', 'Agg')\n"
    program = tmp_path / "notebook.py"
    program.write_text(head + "\n\n".join(cells), encoding="utf-8")
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=600, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "all limits met" in done.stdout, done.stdout


def test_the_notebook_runs_in_a_kernel(tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(EXAMPLES / "terrain.ipynb", as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()


def test_the_viewshed_is_drawn(database: Path) -> None:
    words = [database, 507_000, 3_876_500, 900]
    program = [sys.executable, EXAMPLES / "viewshed.py", *words]
    done = subprocess.run([str(word) for word in program], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 49 and lines[24][24] == "#"
