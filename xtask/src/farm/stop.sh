# Stops a cluster of `cargo xtask farm`: stop.sh FOLDER. It runs when whoever started the cluster is gone, however that
# went, so it asks for nothing that must still be there.
dir=$1
export SLURM_CONF="$dir/slurm.conf"
timeout 5 scancel --user="$(id -u)" 2>/dev/null
for name in n1 n2 n3 slurmctld munge; do
    [ -f "$dir/$name.pid" ] && kill "$(cat "$dir/$name.pid")" 2>/dev/null
done
# Tasks and their keepers know the cluster by its configuration.
for round in 1 2 3; do
    for environ in $(grep -lzxF "SLURM_CONF=$SLURM_CONF" /proc/[0-9]*/environ 2>/dev/null); do
        pid=${environ#/proc/}
        pid=${pid%/environ}
        [ "$pid" != $$ ] && [ "$(cat "/proc/$pid/comm" 2>/dev/null)" != xtask ] && kill -9 "$pid" 2>/dev/null
    done
    sleep 0.1
done
true
