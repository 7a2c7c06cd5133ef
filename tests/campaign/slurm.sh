#!/usr/bin/env bash
# A SLURM of one machine, for the tests: slurm.sh start FOLDER, slurm.sh stop FOLDER. As root, with Debian's packages
# slurm-wlm and munge. Then SLURM_CONF=FOLDER/slurm.conf sbatch ... works.
set -euo pipefail
what=$1 folder=$(realpath -m "$2")
export SLURM_CONF=$folder/slurm.conf

start() {
    mkdir -p "$folder"/{state,spool}
    chmod 755 "$folder"
    dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 status=none
    chmod 600 "$folder/munge.key"
    munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
        --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
    local host=$(hostname -s)
    cat >"$SLURM_CONF" <<END
ClusterName=tests
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ {print int($2 / 2048)}' /proc/meminfo)
PartitionName=main Nodes=$host Default=YES MaxTime=60 State=UP
END
    slurmctld
    slurmd
    for _ in $(seq 60); do
        sinfo --noheader --states=idle --format=%n | grep -q . && return
        sleep 0.5
    done
    tail "$folder"/*.log >&2
    return 1
}

stop() {
    scancel --partition=main || true
    for _ in $(seq 60); do # slurmd outlives its end while steps are left
        pgrep -x slurmstepd >/dev/null || break
        sleep 0.5
    done
    for daemon in slurmd slurmctld munged; do
        [ -f "$folder/$daemon.pid" ] && kill "$(cat "$folder/$daemon.pid")" || true
    done
}

"$what"
