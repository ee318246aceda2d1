#!/bin/sh
# Makes the virtual environment and checks what pip cannot install: prepare.sh PYTHON VENV
# As root on Debian it installs missing system packages; otherwise it says in one line which to install.
set -eu
PYTHON=$1
VENV=$2
export LC_ALL=C PIP_DISABLE_PIP_VERSION_CHECK=1

# What libgmsh of the wheel needs; these six pull in libX11, libXext, libXfixes, libXrender and libfontconfig.
GMSH_PACKAGES="libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"

fail() {
    echo "nvhchain: $1" >&2
    exit 1
}

provide() { # provide WHAT_IS_MISSING PACKAGE...
    what=$1
    shift
    if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
        echo "nvhchain: $what; installing $*"
        apt-get update -qq </dev/null
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" </dev/null
    else
        fail "$what: run 'sudo apt-get install $*' and then make again"
    fi
}

command -v "$PYTHON" >/dev/null || fail "$PYTHON not found: install Python 3.11 or newer, or name it with 'make PYTHON=...'"
version=$("$PYTHON" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "$PYTHON is Python $version, but 3.11 or newer is needed: name a newer one with 'make PYTHON=python3.11'"

if ! "$VENV/bin/python" -m pip --version >/dev/null 2>&1; then
    "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null ||
        provide "Python $version cannot make virtual environments" "python$version-venv"
    "$PYTHON" -m venv --clear "$VENV"
fi

# The build tool comes from the constraints too: an isolated build would fetch whatever is newest.
"$VENV/bin/python" -m pip install --quiet -c constraints.txt setuptools
"$VENV/bin/python" -m pip install --quiet -c constraints.txt --no-build-isolation -e '.[all,test,docs]'

library=$(find "$VENV/lib" -maxdepth 1 -name 'libgmsh.so*' | head -n 1)
missing() {
    ldd "$library" | awk '/not found/ { printf "%s ", $1 }'
}
if [ -n "$library" ] && [ -n "$(missing)" ]; then
    # shellcheck disable=SC2086
    provide "gmsh lacks system libraries ($(missing | sed 's/ $//'))" $GMSH_PACKAGES
    [ -z "$(missing)" ] || fail "gmsh still lacks $(missing)after installing $GMSH_PACKAGES"
fi

# the first command does not wait for the compilation of modules, also where the environment forbids to keep them
"$VENV/bin/python" -m compileall -q nvhchain || true
