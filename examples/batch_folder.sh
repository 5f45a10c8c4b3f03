#!/usr/bin/env bash
# Unwrap every .obj of a folder, and keep a report beside each result.
# usage: batch_folder.sh FROM TO
set -euo pipefail
mkdir -p "$2"
for file in "$1"/*.obj; do
    name=$(basename "$file" .obj)
    python -m omt_uv unwrap "$file" -o "$2/$name.obj" --report "$2/$name.json" || echo "$name: not done" >&2
done
