#!/usr/bin/env bash
# Builds 36 tiles on a Dask cluster of two workers on this host, kills one of them on the way, and compares the bytes
# with a local build.
#
#     TIEFORT=target/release/tiefort PYTHON=venv/bin/python scripts/run_dask.sh
#
# Needs a Python with dask[distributed]. Uses the loopback interface only and ends only processes it started.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
tiefort=$(realpath "${TIEFORT:-$root/target/release/tiefort}")
python=${PYTHON:-python3}
port=${PORT:-18786}
scratch=$(mktemp -d)
started=()
cleanup() {
    for id in "${started[@]}"; do kill "$id" 2> /dev/null || true; done
    wait || true
    rm -rf "$scratch"
}
trap cleanup EXIT
began=$(date +%s%N)
source "$root/scripts/engine_common.sh"

make_job
tell "local build done"
"$tiefort" plan "$scratch/job.toml" --emit dask --out "$scratch/dask.tdb" --pack 1 > "$scratch/build.py"
cd "$scratch"
"$python" -m distributed.cli.dask_scheduler --host 127.0.0.1 --port "$port" --no-dashboard > scheduler.txt 2>&1 &
started+=($!)
worker() {
    "$python" -m distributed.cli.dask_worker "tcp://127.0.0.1:$port" --host 127.0.0.1 --nthreads 1 --no-nanny \
        --no-dashboard --name "$1" > "worker-$1.txt" 2>&1 &
    started+=($!)
}
worker one
doomed=$!
worker two
"$python" build.py "tcp://127.0.0.1:$port" > build.txt 2>&1 &
build=$!
# Killed while tiles are being refined.
until [[ $(find dask.tdb/tiles -name '*.tin' 2> /dev/null | wc -l) -ge ${KILL_AFTER_TILES:-8} ]]; do
    kill -0 "$build" || { cat build.txt scheduler.txt; exit 1; }
    sleep 0.1
done
kill -KILL "$doomed"
tell "a worker killed after $(find dask.tdb/tiles -name '*.tin' | wc -l) tiles"
wait "$build" || { cat build.txt; exit 1; }
tell "the program is done"
compare dask.tdb
tell "same bytes as the local build"
