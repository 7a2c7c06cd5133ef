#!/usr/bin/env bash
# An SSH server of this machine, for the tests: sshd.sh start FOLDER, sshd.sh stop FOLDER. As root, with Debian's package
# openssh-server. Whoever has FOLDER for a home may come in: HOME=FOLDER ssh 127.0.0.1.
set -euo pipefail
what=$1 folder=$(realpath -m "$2")

start() {
    mkdir -p "$folder/.ssh" /run/sshd
    ssh-keygen -q -t ed25519 -N "" -f "$folder/host"
    ssh-keygen -q -t ed25519 -N "" -f "$folder/.ssh/id_ed25519"
    cat >"$folder/.ssh/config" <<END
Host 127.0.0.1
    Port 16822
    User root
    IdentityFile $folder/.ssh/id_ed25519
    UserKnownHostsFile $folder/.ssh/known_hosts
END
    echo "[127.0.0.1]:16822 $(cut -d' ' -f1,2 "$folder/host.pub")" >"$folder/.ssh/known_hosts"
    "$(command -v sshd || echo /usr/sbin/sshd)" -f /dev/null -p 16822 -h "$folder/host" -E "$folder/log" \
        -o ListenAddress=127.0.0.1 -o PidFile="$folder/pid" -o StrictModes=no -o PermitRootLogin=yes \
        -o AuthorizedKeysFile="$folder/.ssh/id_ed25519.pub"
    for _ in $(seq 50); do
        [ -s "$folder/pid" ] && return
        sleep 0.1
    done
    cat "$folder/log" >&2
    return 1
}

stop() {
    kill "$(cat "$folder/pid")"
}

"$what"
