#!/usr/bin/env bash
# What every commit passes: format, lints, tests. Times of each step go to stderr.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Runs a command and tells how long it took.
step() {
    local start=$SECONDS
    printf '== %s\n' "$*" >&2
    "$@"
    printf '== %d s: %s\n\n' $((SECONDS - start)) "$*" >&2
}

step cargo fmt --all --check
step cargo clippy --workspace --all-targets -- -D warnings
step cargo test --workspace
