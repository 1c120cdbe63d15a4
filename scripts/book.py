"""Puts what scripts measure where README and the book show it: between a line that names it and one that ends it."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent
FIGURES = ROOT / "docs" / "figures" / "README.md"


def put(page, name, text):
    """Replaces the figures of that name on a page; `text` is Markdown."""
    places = re.compile(rf"(<!-- figures: {re.escape(name)}, [^\n]*-->\n).*?(<!-- end of figures -->)", re.DOTALL)
    after, count = places.subn(lambda found: f"{found[1]}\n{text.strip()}\n\n{found[2]}", page.read_text())
    assert count == 1, f"{page}: found {count} places for the figures {name}, expected one"
    page.write_text(after)
