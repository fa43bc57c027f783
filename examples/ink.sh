#!/bin/sh
# Paints the pictures of docs/ink.md that take several commands: the landscape, the contact sheet, the mountings, frames of a film, and
# the slides' figures. Everything in them is made here. Build first: cargo build --release --workspace --bins --example footprints.
# FAST=1 paints small ones into out/ink alone.
set -eu
cd "$(dirname "$0")/.."
PATH="$PWD/target/release:$PWD/target/release/examples:$PATH"
out=out/ink
images=docs/images
cell=400x300
whole=1280x960
scroll=260x400
film=480x270
if [ -n "${FAST:-}" ]; then images=$out cell=160x120 whole=320x240 scroll=80x120 film=160x90; fi
mkdir -p "$out" "$images"

landscape "$out/landscape.toml"
[ -e "$out/night.toml" ] || yugen noh performance --edge 50 -o "$out/night.toml"
[ -e "$out/dusk.toml" ] || yugen noh performance --edge 50 --hour dusk -o "$out/dusk.toml"

# A preset with the tables of the landscape.
tabled() {
    { echo "base = \"$1\""; shift; for line in "$@"; do echo "$line"; done; cat examples/ink_landscape.toml; } >"$out/tabled.toml"
}

tabled landscape
yugen ink "$out/landscape.toml" --size "$whole" --preset "$out/tabled.toml" -o "$images/ink_landscape.jpg"

# Rows: the landscape, a dancer by firelight and at dusk, the stage. Columns: presets.
presets="landscape sumi dry splashed blue"
set --
for preset in $presets; do
    tabled "$preset" "mist = 0.75"
    yugen ink "$out/landscape.toml" --size "$cell" --preset "$out/tabled.toml" -o "$out/landscape-$preset.png"
    set -- "$@" "$out/landscape-$preset.png"
done
for view in "night player 6" "dusk front 14"; do
    scene=${view%% *} at=${view##* } camera=${view#* }
    for preset in $presets; do
        yugen ink "$out/$scene.toml" --camera "${camera% *}" --at "$at" --size "$cell" --preset "$preset" --set mist=0 \
            -o "$out/$scene-$preset.png"
        set -- "$@" "$out/$scene-$preset.png"
    done
done
for preset in $presets; do
    yugen ink "$out/dusk.toml" --camera shomen --at 6 --size "$cell" --preset "$preset" --set mist=0 \
        -o "$out/stage-$preset.png"
    set -- "$@" "$out/stage-$preset.png"
done
sheet "$images/ink_sheet.jpg" 5 "$@"

# The four mountings, on one wall.
tabled landscape
set --
for mount in hanging album hand fan; do
    case $mount in
    hanging) camera=scroll size=$scroll ;;
    *) camera=wide size=$cell ;;
    esac
    yugen ink "$out/landscape.toml" --camera "$camera" --size "$size" --preset "$out/tabled.toml" --mount "$mount" \
        -o "$out/mount-$mount.png"
    set -- "$@" "$out/mount-$mount.png"
done
sheet "$images/ink_mounts.jpg" 4 "$@"

# Six frames of the dance.
for frame in "$out"/film_*.png; do [ ! -e "$frame" ] || rm "$frame"; done
yugen ink "$out/night.toml" --camera player --frames 96-101 --size "$film" -o "$out/film_%03d.png"
sheet "$images/ink_film.jpg" 3 "$out"/film_*.png

# The slides' figures by the slides' method: footprints and strokes; contours, wrinkles in light and in thick ink, with rubbing, with
# colour; another pose; a scene.
literally() {
    name=$1 at=$2; shift 2
    yugen ink "$out/dusk.toml" --camera front --at "$at" --size "$cell" --literal "$@" -o "$out/literal-$name.png"
}
footprints "$out/literal-masks.png" "$out/literal-strokes.png"
literally contours 14 --set wrinkle=0 --set wash=0
literally light 14 --set wash=0 --set wrinkle=0.5
literally thick 14 --set wash=0 --set wrinkle=2
literally rubbing 14 --set wash=0 --set rub=1
literally colour 14
literally pose 6
yugen ink "$out/landscape.toml" --camera wide --size "$cell" --literal -o "$out/literal-scene.png"
sheet "$images/ink_literal.jpg" 3 "$out"/literal-masks.png "$out"/literal-strokes.png "$out"/literal-contours.png \
    "$out"/literal-light.png "$out"/literal-thick.png "$out"/literal-rubbing.png \
    "$out"/literal-colour.png "$out"/literal-pose.png "$out"/literal-scene.png
