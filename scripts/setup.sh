#!/bin/sh
# Make .venv and install pinned packages into it: setup.sh core | dev | bench
#
# Needs a Python from 3.11 to 3.15 and nothing else, no root. Everything that is installed is pinned by version and hash in a lock
# file; the project itself comes last, editable, built by the pinned backend. Runs in the repository root, with relative paths
# only, so that a space in the path does no harm. Call it through make, which knows when nothing has changed.
set -eu
cd "$(dirname "$0")/.."

kind=${1:-core}
case $kind in
  core) lock=requirements.lock ;;
  dev) lock=requirements-dev.lock ;;
  bench) lock=requirements-bench.lock ;;
  *) echo "setup.sh: expected core, dev or bench, got $kind" >&2; exit 2 ;;
esac

# The newest is the newest that numba has wheels for.
is_supported() {
  "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 15))' >/dev/null 2>&1
}

# Find the Python: $PYTHON if it is set, else the newest by name.
find_python() {
  for name in ${PYTHON:+"$PYTHON"} python3.15 python3.14 python3.13 python3.12 python3.11 python3 python; do
    if is_supported "$name"; then
      echo "$name"
      return
    fi
  done
  echo "scanspan needs Python 3.11 to 3.15, and found none on the PATH; install one, or name it: make PYTHON=/path/to/python3" >&2
  return 1
}

# Debian leaves ensurepip out of python3: then borrow the pip of that Python, or virtualenv, before giving up.
make_environment() {
  if "$1" -c 'import ensurepip' >/dev/null 2>&1; then
    "$1" -m venv --clear .venv
  elif "$1" -m virtualenv --version >/dev/null 2>&1; then
    "$1" -m virtualenv --quiet --clear .venv
  elif "$1" -m pip --version >/dev/null 2>&1; then
    "$1" -m venv --clear --without-pip .venv
  else
    echo "$1 has neither ensurepip nor pip, so no environment can be made; on Debian and Ubuntu: apt-get install python3-venv" >&2
    return 1
  fi
}

# The packages go in with the environment's own pip, or with the borrowed one.
install() {
  if .venv/bin/python -m pip --version >/dev/null 2>&1; then
    .venv/bin/python -m pip --disable-pip-version-check install --quiet "$@"
  else
    "$python" -m pip --disable-pip-version-check --python .venv/bin/python install --quiet "$@"
  fi
}

python=$(find_python)
if ! is_supported .venv/bin/python; then
  echo "Making .venv with $("$python" --version)"
  make_environment "$python"
fi

echo "Installing $lock into .venv"
install --require-hashes -r "$lock"
install --no-deps --no-build-isolation --no-index --editable .

# Debian packages that a later part needs (a browser for the tests of the viewer) belong here: look for the program, install it
# only when apt-get is there and root is given, and go on without it, saying so, when not.

# A bigger set holds the smaller ones.
case $kind in
  core) touch .venv/.core ;;
  dev) touch .venv/.core .venv/.dev ;;
  bench) touch .venv/.core .venv/.dev .venv/.bench ;;
esac
