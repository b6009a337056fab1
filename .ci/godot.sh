#!/usr/bin/env bash
# Imports sets into a project of Debian's Godot 3 (server, without a screen) and checks what came of them: levels by name with
# the manifest's vertices and triangles, materials with their textures, and a static body for each collider.
#
#     sh .ci/godot.sh target/release/treewright [PRESET ...]
#
# The presets are copied and written for Godot with PNG; Godot 3 reads no KTX2 and no meshopt, so it says nothing of Godot 4.
# The editor imports on start; it may not end by itself afterwards, so it is ended when all is imported.
set -euo pipefail
program=$(realpath "$1")
shift
cd "$(dirname "$0")/.."
godot=$(command -v godot3-server)
work=$(mktemp -d)
editor=
trap '[ -z "$editor" ] || kill -9 "$editor" 2> /dev/null || true; rm -rf "$work"' EXIT
export HOME=$work/home
mkdir -p "$HOME" "$work/project"

cp -r presets "$work/presets"
for set in "${@:-ash}"; do
    # The preset's last line closes it.
    sed -i '$ s/^)$/    engines: [Godot],\n)/' "$work/presets/$set.ron"
    "$program" build "$work/presets/$set.ron" --out "$work/out" > /dev/null 2>&1
    rm "$work/out/$set/${set}_contact.png"
    mv "$work/out/$set/"* "$work/project/"
done
cat > "$work/project/project.godot" << 'END'
config_version=4

[application]
config/name="treewright"
END
cp .ci/godot.gd "$work/project/check.gd"

"$godot" --path "$work/project" --editor --quit > "$work/import.log" 2>&1 &
editor=$!
wanted=$(find "$work/project" -maxdepth 1 -name '*.glb' -o -maxdepth 1 -name '*.png' | wc -l)
imported() { find "$work/project/.import" -name '*.md5' 2> /dev/null | wc -l; }
for _ in $(seq 300); do
    if [ "$(imported)" -ge "$wanted" ]; then break; fi
    kill -0 "$editor" 2> /dev/null || break
    sleep 1
done
if [ "$(imported)" -lt "$wanted" ]; then
    echo "Godot imported $(imported) of $wanted files:" >&2
    tail -20 "$work/import.log" >&2
    exit 1
fi
sleep 2
kill -9 "$editor" 2> /dev/null || true
wait "$editor" 2> /dev/null || true
editor=
timeout 120 "$godot" --path "$work/project" -s check.gd 2>&1 | tee "$work/check.log" | grep -v -e '^Godot Engine' -e '^ *$' -e free_static -e 'core/os/memory' || true
# Godot's exit code gets lost in some of its builds: the last line says it too.
grep -q ' scenes, 0 faults' "$work/check.log"
