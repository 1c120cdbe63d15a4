#!/usr/bin/env bash
# Builds 36 tiles with an engine on this host, kills some or all of its processes on the way, goes on, and compares the
# bytes with a local build.
#
#     TIEFORT=target/release/tiefort scripts/run.sh ninja        ninja is killed with all it started
#     TIEFORT=target/release/tiefort scripts/run.sh snakemake    one task is killed, and tried again
#     TIEFORT=… PYTHON=venv/bin/python scripts/run.sh dask       one of two workers of a cluster is killed
#     TIEFORT=target/release/tiefort scripts/run.sh slurm        a node daemon and its jobs are killed, then the
#                                                                controller
#
# Needs ninja (Debian: ninja-build), snakemake 8 (PyPI), a Python with dask[distributed], or root for Slurm, which
# installs slurm-wlm and munge (Debian) where they are missing. Uses the loopback interface only and ends only processes
# it started.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
tiefort=$(realpath "${TIEFORT:-$root/target/release/tiefort}")
engine=${1:-ninja}
scratch=$(mktemp -d)
chmod 755 "$scratch"
began=$(date +%s%N)
declare -A daemon=()
# The processes of Slurm's jobs on a node, and the step daemons they are children of.
jobs_of() {
    local id
    for id in $(scontrol listpids "" "$1" 2> /dev/null | awk 'NR > 1 && 0 < $1 { print $1 }'); do
        echo "$id"
        # The step daemon alone is ended beside them, not the system's first process.
        awk '$4 != 1 { print $4 }' "/proc/$id/stat" 2> /dev/null || true
    done | sort -u
}
cleanup() {
    local id jobs=
    if [[ $engine == slurm ]]; then jobs="$(jobs_of n1) $(jobs_of n2)"; fi
    for id in $jobs "${daemon[@]}"; do kill -KILL "$id" 2> /dev/null || true; done
    wait 2> /dev/null || true
    rm -rf "$scratch"
}
trap cleanup EXIT

# The job: 18 km x 18 km of the sample terrain, or `SIZE_M` metres, with its roads, washes and lakes unless `FEATURES`
# is empty.
make_job() {
    local size=${SIZE_M:-18000}
    sed -e "s/size_m = \[4000, 4000\]/size_m = [$size, $size]/" -e 's/columns = 2/columns = 6/' \
        -e 's/rows = 2/rows = 6/' "$root/tests/jobs/small.toml" > "$scratch/job.toml"
    if [[ -n ${FEATURES-sample} ]]; then printf '\n[features]\nsources = ["sample"]\n' >> "$scratch/job.toml"; fi
    "$tiefort" build "$scratch/job.toml" --out "$scratch/local.tdb" --quiet
}

# The bytes must be those of the local build, and nothing may be left over.
compare() {
    local database=$1 part
    for part in tiles modules measured survey database.json; do
        diff -r "$scratch/local.tdb/$part" "$database/$part"
    done
    if [[ -n $(find "$database" -name '.*' -not -path "$database") || -e $database/work ]]; then
        echo "left over in $database" >&2
        return 1
    fi
    "$tiefort" verify "$database"
}

# Seconds since the script began, and a line of the log.
tell() { printf '%6.1f s  %s\n' "$(( ($(date +%s%N) - began) / 100000000 ))e-1" "$*"; }

# Starts a process of the cluster, by a name.
start() {
    local name=$1
    shift
    "$@" > "$scratch/$name.out" 2>&1 &
    daemon[$name]=$!
}

# Ninja or Snakemake: a program that reads a file of tasks.
tasks() {
    local file=$1 nothing=$2
    shift 2
    local run=("$@") doomed session
    SIZE_M=${SIZE_M:-9000} make_job
    tell "local build done"
    "$tiefort" plan "$scratch/job.toml" --emit "$engine" --out "$scratch/tasks.tdb" --pack 2 > "$scratch/$file"
    cd "$scratch"
    # In a session of its own, so that it can be killed with all it started.
    setsid "${run[@]}" > log 2>&1 &
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
    "${run[@]}" 2>&1 | tail -1
    tell "$engine is done"
    compare tasks.tdb
    "${run[@]}" 2>&1 | grep "$nothing"
    tell "same bytes as the local build"
}

dask() {
    local python=${PYTHON:-python3} port=${PORT:-18786} build
    make_job
    tell "local build done"
    "$tiefort" plan "$scratch/job.toml" --emit dask --out "$scratch/dask.tdb" --pack 1 > "$scratch/build.py"
    cd "$scratch"
    start scheduler "$python" -m distributed.cli.dask_scheduler --host 127.0.0.1 --port "$port" --no-dashboard
    local name
    for name in one two; do
        start "$name" "$python" -m distributed.cli.dask_worker "tcp://127.0.0.1:$port" --host 127.0.0.1 --nthreads 1 \
            --no-nanny --no-dashboard --name "$name"
    done
    "$python" build.py "tcp://127.0.0.1:$port" > build.txt 2>&1 &
    build=$!
    # Killed while tiles are being refined.
    until [[ $(find dask.tdb/tiles -name '*.tin' 2> /dev/null | wc -l) -ge ${KILL_AFTER_TILES:-8} ]]; do
        kill -0 "$build" || { cat build.txt scheduler.out; exit 1; }
        sleep 0.1
    done
    kill -KILL "${daemon[one]}"
    tell "a worker killed after $(find dask.tdb/tiles -name '*.tin' | wc -l) tiles"
    wait "$build" || { cat build.txt; exit 1; }
    tell "the program is done"
    compare dask.tdb
    tell "same bytes as the local build"
}

slurm() {
    if ! command -v slurmctld slurmd munged > /dev/null; then
        apt-get update --quiet
        # Their services are not to start by themselves.
        printf '#!/bin/sh\nexit 101\n' > /usr/sbin/policy-rc.d && chmod +x /usr/sbin/policy-rc.d
        DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends slurm-wlm munge
        rm /usr/sbin/policy-rc.d
    fi
    SIZE_M=${SIZE_M:-36000} make_job
    tell "local build done"

    host=$(hostname -s)
    export SLURM_CONF=$scratch/slurm.conf
    mkdir "$scratch/state" "$scratch/spool.n1" "$scratch/spool.n2" "$scratch/munge"
    chmod 700 "$scratch/munge"
    dd if=/dev/urandom of="$scratch/munge/key" bs=1024 count=1 status=none
    chmod 400 "$scratch/munge/key"
    cat > "$SLURM_CONF" << CONF
ClusterName=tiefort
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${PORT:-16817}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$scratch/munge/socket,cred_expire=5
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
StateSaveLocation=$scratch/state
SlurmdSpoolDir=$scratch/spool.%n
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdPidFile=$scratch/slurmd.%n.pid
SlurmctldLogFile=$scratch/slurmctld.log
SlurmdLogFile=$scratch/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=2,sched_min_interval=100000,bf_interval=2
ReturnToService=2
SlurmdTimeout=8
JobRequeue=1
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((${PORT:-16817} + 1)) CPUs=2 RealMemory=4000 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((${PORT:-16817} + 2)) CPUs=2 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
    start munged munged --foreground --force --socket="$scratch/munge/socket" --key-file="$scratch/munge/key" \
        --pid-file="$scratch/munge/pid" --log-file="$scratch/munge/log" --seed-file="$scratch/munge/seed"
    until [[ -S $scratch/munge/socket ]]; do sleep 0.1; done
    start slurmctld slurmctld -D -f "$SLURM_CONF"
    start n1 slurmd -D -N n1 -f "$SLURM_CONF"
    start n2 slurmd -D -N n2 -f "$SLURM_CONF"
    for _ in {1..60}; do [[ $(sinfo --noheader --format %T 2> /dev/null) == idle ]] && break; sleep 0.5; done
    sinfo
    tell "two nodes are up"

    "$tiefort" plan "$scratch/job.toml" --emit slurm --out "$scratch/slurm.tdb" --pack "${PACK:-2}" \
        > "$scratch/build.sh"
    export TIEFORT=$tiefort TIEFORT_MEMORY=200M TIEFORT_PAUSE=2
    last=$(bash "$scratch/build.sh")
    tell "submitted, the last job is $last"
    tins() { find "$scratch/slurm.tdb/tiles" -name '*.tin' 2> /dev/null | wc -l; }
    # Whether the controller answers, and knows no job that is waiting or running.
    is_idle() { local jobs; jobs=$(squeue --noheader 2> /dev/null) && [[ -z $jobs ]]; }
    until [[ $(tins) -ge 4 ]]; do sleep 0.2; done
    doomed=$(jobs_of n1)
    kill -KILL "${daemon[n1]}" $doomed 2> /dev/null || true
    tell "node n1 killed with its jobs after $(tins) tiles"
    until [[ $(sinfo --noheader --nodes n1 --format %T) == down* ]]; do sleep 0.5; done
    tell "n1 is down after $(tins) tiles"
    squeue --format '%.6i %.24j %.10T %.8N' | head -8
    more=$(($(tins) + 3))
    until [[ $(tins) -ge $more ]]; do sleep 0.2; done
    kill -KILL "${daemon[slurmctld]}"
    tell "controller killed after $(tins) tiles"
    sleep 2
    start slurmctld slurmctld -D -f "$SLURM_CONF"
    start n1 slurmd -D -N n1 -f "$SLURM_CONF"
    tell "controller and n1 started again"
    for _ in {1..2400}; do
        [[ -e $scratch/slurm.tdb/report.json ]] && is_idle && break
        sleep 0.5
    done
    "$tiefort" status "$scratch/slurm.tdb" || true
    tell "the queue is empty"
    compare "$scratch/slurm.tdb" ||
        { tail -20 "$scratch"/slurm.tdb.slurm/*; tail -40 "$scratch/slurmctld.log"; exit 1; }
    requeued=$(grep -c -i 'requeue' "$scratch/slurmctld.log" || true)
    tell "same bytes as the local build; the controller's log speaks of requeues $requeued times"
}

case $engine in
ninja) tasks build.ninja 'no work to do' ninja -j 2 ;;
snakemake) tasks Snakefile 'Nothing to be done' snakemake --cores 2 ;;
dask | slurm) "$engine" ;;
*) printf 'found %s, expected ninja, snakemake, dask or slurm\n' "$engine" >&2 && exit 2 ;;
esac
