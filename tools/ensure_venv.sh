#!/bin/sh
# Makes a virtual environment: ensure_venv.sh FOLDER, with the first Python on the path that the suite runs on.
# Debian ships Python without what venv needs; that is installed where we may.
set -eu
folder=$1
fits() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' 2>/dev/null
}
for python in python3.11 python3.12 python3.13 python3.14 python3 none; do
    ! fits "$python" || break
done
if [ "$python" = none ]; then
    found=$(python3 -V 2>/dev/null || echo "no Python")
    echo "arc_suite needs Python 3.11 to 3.14, found $found: install one, such as by 'uv python install 3.12'" >&2
    exit 1
fi
if ! "$python" -c 'import ensurepip' 2>/dev/null; then
    "$(dirname "$0")/ensure_packages.sh" python3-venv
fi
[ -x "$folder/bin/pip" ] || "$python" -m venv --clear "$folder"
# dm_control asks for labmaze, which has no wheel from 3.13 on; see setup.cfg.
if "$folder/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 13))'; then
    "$folder/bin/python" -m pip install -q --no-deps dm-control==1.0.50
fi
