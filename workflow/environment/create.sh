#!/usr/bin/env bash
# Creates the virtual environment of the study from environment.lock.
#
# Usage: workflow/environment/create.sh FOLDER PYTHON      (called by `make environment`)
#
# Every package is checked against the hashes in the lock file. cyipopt has no wheel for Linux: it
# is built against the IPOPT inside the casadi wheel, so casadi and the build tools come first.
set -euo pipefail

folder=$1
python=$2
cd "$(dirname "$0")/../.."

"$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || {
    echo "The environment needs Python 3.11; '$python' is another version or missing. Give its path: make PYTHON=..." >&2
    exit 1
}
command -v gcc >/dev/null || {
    echo "cyipopt and the equations of motion are compiled: install gcc." >&2
    exit 1
}

# Prints the lock entries (version and hashes) of the named packages.
locked() {
    awk -v wanted="^($(IFS='|'; echo "$*"))==" '/^[a-z]/ { keep = $0 ~ wanted } keep' environment.lock
}

install() {
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check \
        --no-deps --no-build-isolation "$@"
}

# The interpreter itself: found through the folder that is made anew, it would vanish with it.
python=$("$python" -c 'import os, sys; print(os.path.realpath(sys.executable))')
rm -rf "$folder"
"$python" -m venv "$folder"
export PATH="$PWD/$folder/bin:$PATH"

install --require-hashes -r <(locked pip setuptools wheel pkgconf cython numpy casadi)
PKG_CONFIG_PATH=$(python workflow/environment/write_ipopt_pc.py)
export PKG_CONFIG_PATH
# The built extension looks for IPOPT in the casadi folder beside it.
LDFLAGS='-Wl,-rpath,$ORIGIN/../casadi' \
    install --require-hashes --no-binary cyipopt \
    -r environment.lock
install --editable .
python -m pip check
python -c 'import cyipopt; print("cyipopt uses IPOPT", *cyipopt.IPOPT_VERSION)'
