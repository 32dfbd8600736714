#!/bin/sh
# Installs Debian packages if this user may, else says in one line what to install.
set -eu
if ! command -v apt-get >/dev/null; then
    echo "please install what Debian calls: $*" >&2
    exit 1
elif [ "$(id -u)" = 0 ]; then
    sudo=
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    sudo=sudo
else
    echo "please run: apt-get install $*" >&2
    exit 1
fi
$sudo apt-get update -qq
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "$@" >/dev/null
