#!/usr/bin/env bash
# Simulates builds by one to five workers on a store that fails, tears, delays and forgets what was not synced, whose
# workers are ended at any step and whose computers lose their power: one run for each seed from FIRST to END - 1.
#
#     scripts/simulate.sh [FIRST [END]]      0 to 100,000 by default: an hour and a half on one core
#
# Every run must end in the bytes of an undisturbed build. A run depends on nothing but its seed, so one that failed is
# repeated by `scripts/simulate.sh SEED $((SEED + 1))`. `cargo test` does the first few hundred.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

TIEFORT_SEEDS="${1:-0}..${2:-100000}" cargo test -q -p build --test it -- \
    --ignored --exact --nocapture simulated::the_campaign_finds_nothing
