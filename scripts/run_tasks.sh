#!/usr/bin/env bash
# Builds 36 tiles with an engine that runs the tasks on one host, kills some or all of them on the way, goes on, and
# compares the bytes with a local build.
#
#     TIEFORT=target/release/tiefort scripts/run_tasks.sh ninja        ninja is killed with all it started
#     TIEFORT=target/release/tiefort scripts/run_tasks.sh snakemake    one task is killed, and tried again
#
# Needs ninja (Debian: ninja-build) or snakemake 8 (PyPI). Ends only processes it started.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
tiefort=$(realpath "${TIEFORT:-$root/target/release/tiefort}")
engine=${1:-ninja}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
began=$(date +%s%N)
source "$root/scripts/engine_common.sh"

case $engine in
ninja) file=build.ninja start=(ninja -j 2) nothing='no work to do' ;;
snakemake) file=Snakefile start=(snakemake --cores 2) nothing='Nothing to be done' ;;
*) printf 'found %s, expected ninja or snakemake\n' "$engine" >&2 && exit 2 ;;
esac

SIZE_M=${SIZE_M:-9000} make_job
tell "local build done"
"$tiefort" plan "$scratch/job.toml" --emit "$engine" --out "$scratch/tasks.tdb" --pack 2 > "$scratch/$file"
cd "$scratch"
# In a session of its own, so that it can be killed with all it started.
setsid "${start[@]}" > log 2>&1 &
session=$!
# Engines give every task a process group of its own, so the session tells which are theirs: "ID NAME" of each. A
# process that ends between the listing and the reading is none of them, and no fault.
theirs() {
    sed -n "s/^\([0-9]*\) (\(.*\)) [A-Z] [0-9]* [0-9]* $session .*/\1 \2/p" /proc/[0-9]*/stat 2> /dev/null || true
}
if [[ $engine == ninja ]]; then
    sleep "${KILL_AFTER_S:-1}"
    mapfile -t doomed < <(theirs | cut -d' ' -f1)
    if kill -KILL "${doomed[@]}" 2> /dev/null; then tell "ninja and its tasks killed"; fi
    wait "$session" || true
else
    doomed=
    while [[ -z $doomed ]] && kill -0 "$session" 2> /dev/null; do
        doomed=$(theirs | sed -n 's/ tiefort$//p' | head -1)
        if [[ -n $doomed ]] && ! kill -KILL "$doomed" 2> /dev/null; then doomed=; fi
    done
    tell "task $doomed killed"
    wait "$session" || { cat log; exit 1; }
    # Only what was not done is tried again.
    grep -q 'Trying to restart' log || { cat log; exit 1; }
fi
"$tiefort" status tasks.tdb || true
"${start[@]}" 2>&1 | tail -1
tell "$engine is done"
compare tasks.tdb
"${start[@]}" 2>&1 | grep "$nothing"
tell "same bytes as the local build"
