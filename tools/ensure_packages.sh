#!/bin/sh
# Installs Debian packages if this user may, and says so first; else says in one line what is missing.
set -eu
if ! command -v apt-get >/dev/null; then
    echo "missing: please install what Debian calls $*" >&2
    exit 1
elif [ "$(id -u)" = 0 ]; then
    sudo=
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
    sudo=sudo
else
    echo "missing: please have root run apt-get install $*" >&2
    exit 1
fi
echo "missing Debian packages, installed now as root: ${sudo:+sudo }apt-get install $*" >&2
$sudo apt-get update -qq
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "$@" >/dev/null
