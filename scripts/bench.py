#!/usr/bin/env python3
"""Measures the compiler, and writes what it finds into README and the book.

    scripts/bench.py NAME [--tiefort PATH] [--book] …      scripts/bench.py NAME --help tells what each measures

What a bench needs from PyPI is installed into target/bench/venv. TIEFORT_DATA names the folder of the shared data; what
is missing there is skipped with a word.
"""

import importlib
import inspect
import sys

# Module and function of each bench.
BENCHES = {
    "peers": "peers", "speed": "speed", "fidelity": "fidelity", "limit": "limit", "borders": "limit",
    "methods": "paper", "paper": "paper", "features": "features", "scale": "features", "crowd": "features",
    "growth": "growth",
    "size": "program", "reader": "program", "serve": "program", "python": "package", "selftest": "selftest",
}


def main():
    name = sys.argv[1] if 1 < len(sys.argv) else ""
    if name not in BENCHES:
        print(inspect.cleandoc(__doc__), f"\nfound {name or 'no name'}, expected one of: {', '.join(BENCHES)}")
        return 2
    bench = getattr(importlib.import_module(f"benches.{BENCHES[name]}"), name)
    sys.argv[:2] = [f"bench.py {name}"]
    return bench()


if __name__ == "__main__":
    sys.exit(main())
