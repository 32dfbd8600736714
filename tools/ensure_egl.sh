#!/bin/sh
# Makes sure that pictures can be rendered without a display: ensure_egl.sh PYTHON.
set -eu
works() {
    "$1" -c 'import arc_suite; arc_suite.load("tick", "walk").physics.render(16, 16)' 2>/dev/null
}
works "$1" || "$(dirname "$0")/ensure_packages.sh" libegl1 libgl1 libgl1-mesa-dri
