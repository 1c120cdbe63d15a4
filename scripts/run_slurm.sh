#!/usr/bin/env bash
# Builds 36 tiles on a Slurm cluster of two node daemons on this host, kills one of them with its jobs and later the
# controller, and compares the bytes with a local build.
#
#     TIEFORT=target/release/tiefort scripts/run_slurm.sh
#
# Installs slurm-wlm and munge (Debian) where they are missing. Controller and node daemons are ordinary processes of
# this script, listen on the loopback interface only, and are ended by their ids. Needs root.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
tiefort=$(realpath "${TIEFORT:-$root/target/release/tiefort}")
if ! command -v slurmctld slurmd munged > /dev/null; then
    apt-get update --quiet
    # Their services are not to start by themselves.
    printf '#!/bin/sh\nexit 101\n' > /usr/sbin/policy-rc.d && chmod +x /usr/sbin/policy-rc.d
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends slurm-wlm munge
    rm /usr/sbin/policy-rc.d
fi
scratch=$(mktemp -d)
chmod 755 "$scratch"
declare -A daemon=()
# The processes of jobs on a node, and the step daemons they are children of.
jobs_of() {
    local id
    for id in $(scontrol listpids "" "$1" 2> /dev/null | awk 'NR > 1 && 0 < $1 { print $1 }'); do
        echo "$id"
        # The step daemon alone is ended beside them, not the system's first process.
        awk '$4 != 1 { print $4 }' "/proc/$id/stat" 2> /dev/null || true
    done | sort -u
}
cleanup() {
    local id jobs
    jobs="$(jobs_of n1) $(jobs_of n2)"
    for id in $jobs "${daemon[@]}"; do kill -KILL "$id" 2> /dev/null || true; done
    wait 2> /dev/null || true
    rm -rf "$scratch"
}
trap cleanup EXIT
began=$(date +%s%N)
source "$root/scripts/engine_common.sh"

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
start() {
    local name=$1
    shift
    "$@" > "$scratch/$name.out" 2>&1 &
    daemon[$name]=$!
}
start munged munged --foreground --force --socket="$scratch/munge/socket" --key-file="$scratch/munge/key" \
    --pid-file="$scratch/munge/pid" --log-file="$scratch/munge/log" --seed-file="$scratch/munge/seed"
until [[ -S $scratch/munge/socket ]]; do sleep 0.1; done
start slurmctld slurmctld -D -f "$SLURM_CONF"
start n1 slurmd -D -N n1 -f "$SLURM_CONF"
start n2 slurmd -D -N n2 -f "$SLURM_CONF"
for _ in {1..60}; do [[ $(sinfo --noheader --format %T 2> /dev/null) == idle ]] && break; sleep 0.5; done
sinfo
tell "two nodes are up"

"$tiefort" plan "$scratch/job.toml" --emit slurm --out "$scratch/slurm.tdb" --pack "${PACK:-2}" > "$scratch/build.sh"
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
compare "$scratch/slurm.tdb" || { tail -20 "$scratch"/slurm.tdb.slurm/*; tail -40 "$scratch/slurmctld.log"; exit 1; }
requeued=$(grep -c -i 'requeue' "$scratch/slurmctld.log" || true)
tell "same bytes as the local build; the controller's log speaks of requeues $requeued times"
