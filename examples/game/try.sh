#!/bin/sh
# Builds the game with Ninja, and with CMake where there is one, edits what an artist edits, and sees that each edit
# builds what it touches and nothing else. TREEWRIGHT names the program. Ends with 77 where there is no Ninja.
set -eu
command -v ninja > /dev/null || exit 77
TREEWRIGHT=${TREEWRIGHT:-$(command -v treewright)}
export TREEWRIGHT
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Builds, and compares what was done, in any order, with what should have been.
expect() {
  why=$1; shift
  wanted=$(printf '%s\n' "$@" | sort)
  $build > log 2>&1 || { cat log >&2; exit 1; }
  done_=$(grep -oE '(growing [a-z]+|packing game.pak)' log | sort || true)
  if [ "$done_" != "$wanted" ]; then
    printf '%s: %s\nwanted: %s\ndone: %s\n' "$tool" "$why" "$wanted" "$done_" >&2
    cat log >&2
    exit 1
  fi
  edits=$((edits + 1))
  # Ninja tells files apart by their times.
  sleep 0.05
}

edits=0
play() {
  expect "from nothing" "growing hedge" "growing lone" "packing game.pak"
  expect "nothing touched" ""
  sed -i.bak 's/seed: 3,/seed: 4,/' trees/hedge.ron
  expect "a preset" "growing hedge" "packing game.pak"
  sed -i.bak 's/a86a24/b07030/' trees/lone.ron
  expect "a tint" "growing lone" "packing game.pak"
  sed -i.bak '1a // A remark.' trees/hedge.ron
  expect "a comment" "growing hedge"
  sed -i.bak '1a // A remark.' trees/species/bush.ron
  expect "a comment in the species" "growing hedge" "growing lone"
  sed -i.bak 's/height: [0-9.]*,/height: 2.2,/' trees/species/bush.ron
  expect "the species, whose height one of them overrides" "growing hedge" "growing lone" "packing game.pak"
  expect "nothing touched" ""
}

cp -R "$here" "$work/ninja" && cd "$work/ninja" && rm -rf build
tool=Ninja
build="ninja"
play
if command -v cmake > /dev/null; then
  cp -R "$here" "$work/cmake" && cd "$work/cmake" && rm -rf build build.ninja
  tool="CMake and Ninja"
  cmake -G Ninja -B build "-DTREEWRIGHT=$TREEWRIGHT" > log 2>&1 || { cat log >&2; exit 1; }
  build="cmake --build build"
  play
fi
echo "$tool: $edits builds did what their edits touched and nothing else"
