#!/usr/bin/env bash
# Makes the wheel of the Python package in target/wheels, with the viewer's page: module and command in one file.
# Needs Python 3.9 or newer, whose pip fetches maturin, and Node for the page; `--no-viewer` leaves the page out,
# `--profile NAME` builds with another profile than release. One wheel serves every CPython from 3.9 on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

viewer=yes profile=release
while [[ $# -gt 0 ]]; do
    case $1 in
    --no-viewer) viewer=no ;;
    --profile) profile=$2 && shift ;;
    *) printf 'found %s, expected --no-viewer or --profile NAME\n' "$1" >&2 && exit 2 ;;
    esac
    shift
done
# Unless one is installed, maturin lives in an environment of its own.
maturin=$(command -v maturin || true)
if [[ -z $maturin ]]; then
    tools=${CARGO_TARGET_DIR:-target}/tools/python
    [[ -x $tools/bin/maturin ]] || { python3 -m venv "$tools" && "$tools/bin/pip" install --quiet 'maturin>=1.9,<2'; }
    maturin=$(realpath "$tools/bin/maturin")
fi
features=()
if [[ $viewer == yes ]]; then
    scripts/build_viewer.sh
    features=(--features viewer)
fi
rm -f target/wheels/tiefort-*.whl
cd crates/tiefort-python
"$maturin" build --locked --profile "$profile" --out ../../target/wheels "${features[@]}" >&2
cd ../..
ls target/wheels/tiefort-*.whl
