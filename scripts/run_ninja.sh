#!/usr/bin/env bash
# Builds 36 tiles with ninja, kills it on the way, goes on, and compares the bytes with a local build.
#
#     TIEFORT=target/release/tiefort scripts/run_ninja.sh
#
# Needs ninja (Debian: ninja-build). Ends only processes it started.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
tiefort=$(realpath "${TIEFORT:-$root/target/release/tiefort}")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
began=$(date +%s%N)
source "$root/scripts/engine_common.sh"

SIZE_M=${SIZE_M:-9000} make_job
tell "local build done"
"$tiefort" plan "$scratch/job.toml" --emit ninja --out "$scratch/ninja.tdb" --pack 2 > "$scratch/build.ninja"
# In a session of its own, so that it can be killed with all it started.
setsid ninja -C "$scratch" -j 2 > "$scratch/log" 2>&1 &
ninja=$!
sleep "${KILL_AFTER_S:-2}"
# Ninja gives every task a process group of its own, so the session tells which are its.
mapfile -t started < <(sed 's/^\([0-9]*\) .*) [A-Z] [0-9]* [0-9]* \([0-9]*\) .*/\2 \1/' /proc/[0-9]*/stat 2> /dev/null |
    sed -n "s/^$ninja //p")
if kill -KILL "${started[@]}" 2> /dev/null; then tell "ninja and its tasks killed"; fi
wait "$ninja" || true
"$tiefort" status "$scratch/ninja.tdb" || true
ninja -C "$scratch" -j 2 | tail -1
tell "ninja is done"
compare "$scratch/ninja.tdb"
ninja -C "$scratch" | grep 'no work to do'
tell "same bytes as the local build"
