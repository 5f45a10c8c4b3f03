#!/bin/sh
# Print a Python for which bpy has a wheel and which can make a virtual environment. Candidates are run, since
# a command can be on PATH and still be a shim for a version that is not active.
# usage: find_python.sh [VERSION...]   (default: 3.11 3.13)
[ $# -gt 0 ] || set -- 3.11 3.13
for version in "$@"; do
    for python in "python$version" "$HOME"/.pyenv/versions/"$version".*/bin/python3 \
        /usr/local/bin/"python$version" /opt/homebrew/bin/"python$version" python3 python; do
        if "$python" -c "import sys, ensurepip, venv
sys.exit('%d.%d' % sys.version_info[:2] != '$version')" >/dev/null 2>&1; then
            echo "$python"
            exit 0
        fi
    done
done
echo "No usable Python $(echo "$*" | sed 's/ / or /g') was found (bpy has wheels for these only)." \
    "Install one and put it on PATH, or run: make PYTHON=/path/to/python ..." >&2
exit 1
