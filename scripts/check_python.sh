#!/usr/bin/env bash
# Checks the Python package as a stranger gets it: installs a wheel into fresh environments, one with NumPy alone, with
# no Rust, compiler or GDAL on the path; runs the book's examples, the command, the tests and the notebook; then mypy
# and ruff. With --extras also the packages that meshes and databases are given to. Says so and ends where there is no
# Python to check with.
#
# usage: scripts/check_python.sh [--extras] WHEEL      (scripts/build_wheel.sh makes one)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

extras=no
[[ ${1:-} == --extras ]] && extras=yes && shift
wheel=$(realpath "${1:?expected the wheel to check}")
python=${PYTHON:-python3}
if ! "$python" -c 'import sys, venv; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
    printf 'skipped: found no Python 3.9 or newer with venv\n' >&2
    exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
package=crates/tiefort-python

# Only what was installed, and what a shell needs.
mkdir "$scratch/few"
for tool in env sh cat ls; do ln -s "$(command -v "$tool")" "$scratch/few/$tool"; done
alone() { env --ignore-environment HOME="$scratch" PATH="$scratch/$1/bin:$scratch/few" "${@:2}"; }

printf '== a fresh environment with NumPy alone\n' >&2
"$python" -m venv "$scratch/plain"
start=$SECONDS
"$scratch/plain/bin/pip" install --quiet --disable-pip-version-check "$wheel"
printf 'installed in %d s: %s bytes of wheel, %s kB on the disk\n' $((SECONDS - start)) "$(stat -c %s "$wheel")" \
    "$(du -sk "$scratch"/plain/lib/python*/site-packages/tiefort | cut -f1)" >&2
# The examples of the book: the first block in Python of a page. The second one reads a database.
block() { awk '/^```python/ { copy = 1; next } /^```/ && copy { exit } copy' "docs/guides/$1.md"; }
block python >"$scratch/example.py"
block simulators >"$scratch/reading.py"
[[ -s $scratch/example.py && -s $scratch/reading.py ]]
(cd "$scratch" && alone plain tiefort sample --out dem.tif && alone plain python example.py)
(cd "$scratch" && cp -r demo.tdb mine.tdb && alone plain python reading.py)
[[ -s $scratch/mesh.ply ]]
(cd "$scratch" && alone plain tiefort tin dem.tif --points 500 --out again.ply && alone plain tiefort --version)
alone plain python -m tiefort --help >/dev/null
if alone plain tiefort tin missing.tif --points 50 --out a.ply 2>"$scratch/told"; then exit 1; else code=$?; fi
[[ $code == 2 ]] && grep -q '^error: missing.tif' "$scratch/told" && grep -q '^hint: ' "$scratch/told"

printf '== tests\n' >&2
"$scratch/plain/bin/pip" install --quiet --disable-pip-version-check pytest
cp -r "$package/tests" "$package/examples" "$scratch"
(cd "$scratch/tests" && alone plain python -m pytest -q -p no:cacheprovider .)

printf '== mypy and ruff\n' >&2
"$python" -m venv "$scratch/tools"
"$scratch/tools/bin/pip" install --quiet --disable-pip-version-check "$wheel" mypy ruff pytest
cp "$package/pyproject.toml" "$scratch"
cp -r "$package/python" "$scratch"
(cd "$scratch" && tools/bin/mypy && tools/bin/ruff check python examples tests &&
    tools/bin/ruff format --check python examples tests)

if [[ $extras == yes ]]; then
    printf '== with the extras\n' >&2
    "$python" -m venv "$scratch/full"
    "$scratch/full/bin/pip" install --quiet --disable-pip-version-check "$wheel[all]" pytest rioxarray matplotlib \
        nbclient ipykernel
    (cd "$scratch/tests" && alone full python -m pytest -q -p no:cacheprovider .)
fi
printf '== the package is sound\n' >&2
