#!/bin/sh
# Makes a virtual environment: ensure_venv.sh FOLDER. Debian ships Python without what venv needs;
# that is installed where we may.
set -eu
folder=$1
python=$(command -v python3.11 || command -v python3) || { echo "arc_suite needs Python 3.11 or later" >&2; exit 1; }
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    { echo "arc_suite needs Python 3.11 or later; $python is $("$python" -V)" >&2; exit 1; }
if ! "$python" -c 'import ensurepip' 2>/dev/null; then
    "$(dirname "$0")/ensure_packages.sh" python3-venv
fi
[ -x "$folder/bin/pip" ] || "$python" -m venv --clear "$folder"
