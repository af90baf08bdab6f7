#!/bin/sh
# Renders the pictures of docs/gallery.md and writes the page: `docs/gallery.sh [PROGRAM]`, by default the `clerestory` in the search path.
#
# Every technique gets as much time on each scene; its error is measured against the path tracer's picture of the same light paths.
# Environment: TIME (of each picture, default 5s), REFERENCE (samples per pixel of references, times the scene's factor, default 4096),
# SIZE (pixels along a side, default 192).
set -eu
program=${1:-clerestory}
time=${TIME:-5s}
reference_spp=${REFERENCE:-4096}
size=${SIZE:-192}
docs=$(dirname "$0")
folder=$docs/gallery
page=$docs/gallery.md
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder"
rm -f "$folder"/*.png

# number KEY FILE, words KEY FILE: the first of that key in indented JSON.
number() { sed -n "s/^ *\"$1\": \([^\",]*\),\{0,1\}\$/\1/p" "$2" | head -n 1; }
words() { sed -n "s/^ *\"$1\": \"\(.*\)\",\{0,1\}\$/\1/p" "$2" | head -n 1; }
# The greatest number of samples that a pixel has got.
samples() { awk '/^  "samples": \[/ { getline; getline; gsub(/[ ,]/, ""); print; exit }' "$1"; }
# percent NUMBER, root NUMBER: as per cent, the number and its square root.
percent() { awk -v x="$1" 'BEGIN { printf "%+.2f %%", 100 * x }'; }
root() { awk -v x="$1" 'BEGIN { printf "%.2f %%", 100 * sqrt(x) }'; }
in_table() { printf '%s' "$1" | sed 's/|/\\|/g'; }
render() { "$program" render --size "${size}x$size" "$@"; }

# The path tracer's picture of a scene's light paths, made once; its noise is written beside it.
reference() {
    [ -f "$2.exr" ] && return
    render "$scene" --technique path --path-set "$1" --seed 1 --spp $((reference_spp * factor)) --exposure "$exposure" -o "$2.exr" \
        >"$2.txt"
    sed -n 's/.*noise at most about \([0-9.]*\), by.*/\1/p' "$2.txt" >"$2.noise"
}

# One row of the table, or one line where the technique refuses.
row() {
    technique=$1
    picture=$work/$name-$technique
    # The first picture compiles the kernels, and shows whether the technique refuses.
    code=0
    render "$scene" --technique "$technique" --spp 1 --stats none -o "$picture.exr" 2>"$picture.txt" || code=$?
    if [ "$code" = 3 ]; then
        why=$(sed -n 's/^error: .*cannot render this scene: //p' "$picture.txt")
        printf -- '- `%s` refuses this scene: %s.\n' "$technique" "$why" >>"$work/refused"
        return
    elif [ "$code" != 0 ]; then
        cat "$picture.txt" >&2
        exit "$code"
    fi
    render "$scene" --technique "$technique" --spp 1000000 --time-budget "$time" --exposure "$exposure" --stats none -o "$picture.exr" \
        2>/dev/null
    paths=$(words path_set "$picture.json")
    # A path set is long for a file's name.
    against=$work/$name-$(printf '%s' "$paths" | cksum | cut -d ' ' -f 1)
    reference "$paths" "$against"
    shown=$folder/$name-$technique
    cp "$picture.png" "$shown.png"
    "$program" compare "$picture.exr" "$against.exr" --exposure "$exposure" --json --diff "$shown-difference.png" \
        >"$picture.compare" 2>/dev/null
    printf '| `%s` | ![%s by %s](gallery/%s.png) | ![its difference](gallery/%s.png) | `%s` | %s | %s | %.3g | %s | %.1f | %.2f %% |\n' \
        "$technique" "$name" "$technique" "$name-$technique" "$name-$technique-difference" "$(in_table "$paths")" \
        "$(root "$(number relative_mse "$picture.compare")")" "$(percent "$(number relative_bias "$picture.compare")")" \
        "$(number quantile_999 "$picture.compare")" "$(samples "$picture.json")" "$(number render_seconds "$picture.json")" \
        "$(awk '{ print 100 * $1 }' "$against.noise")" >>"$work/table"
}

# A scene: its name on the page, its address, the exposure of its pictures in stops, the factor of its references' samples, and what it shows.
scene() {
    name=$1 scene=$2 exposure=$3 factor=$4
    : >"$work/table"
    : >"$work/refused"
    for technique in $techniques; do row "$technique"; done
    printf '\n## %s\n\n`%s`: %s\n\n' "$name" "$scene" "$5" >>"$work/page"
    printf '| technique | picture | difference | light paths | error | bias | full colour | samples per pixel | seconds | noise of the reference |\n' >>"$work/page"
    printf '|---|---|---|---|---:|---:|---:|---:|---:|---:|\n' >>"$work/page"
    cat "$work/table" >>"$work/page"
    [ -s "$work/refused" ] && { echo; cat "$work/refused"; } >>"$work/page"
    return 0
}

techniques=$("$program" list --json | sed -n '/^  "techniques": \[/,/^  \]/s/^      "id": "\(.*\)",\{0,1\}$/\1/p')
scene lamp 'builtin:cornell-box?source=point' 0 1 \
    'A point light over diffuse surfaces. The preview shows what is lit directly, the others also the light between the walls.'
scene caustic 'builtin:cornell-box?sphere=glass&boxes=none&lamp=0.1' 1 8 \
    'A small lamp over a glass sphere. Paths from the eye find the lamp through the glass by chance only; photons start there.'
scene ring 'builtin:ring?roughness=0.3' 0 2 \
    'A rough metal ring under a point light: its caustic is wide enough for paths from the eye, and kernels of photons blur it.'
scene fog 'builtin:fog-box?sphere=glass&boxes=none&lamp=0.1&sigma_s=3' 1 8 \
    'Fog around a glass sphere under a small lamp: its caustic is in the fog as well as on the floor, and photons that collide on their way show it.'
scene haze 'builtin:passage?sigma_a=0.05&sigma_s=0.5&g=0.6' 1 4 \
    'Haze on both sides of a narrow passage: what little light comes through lies in shafts in the air.'
scene soup 'builtin:triangle-soup?n=300' 0 1 \
    'Opaque triangles under a uniform sky, which every technique can render; the preview lets the sky shine through everything.'

{
    cat <<END_OF_HEAD
# Gallery: every technique on the same scenes

Written by \`docs/gallery.sh\`, which renders everything anew. Every picture of $size × $size pixels had $(printf '%s' "$time" | sed 's/s$/ s/'), after one that compiled the
kernels, on $(words device "$work/lamp-path.json"), driver $(words driver "$work/lamp-path.json").

- *difference*: signed, from the path tracer's picture of the same light paths: red too bright, blue too dark, white equal. *full colour* is the
  radiance shown as pure red or blue, the 99.9 % quantile of the absolute error.
- *error*: the root of the relative MSE against that reference, noise and bias together; *bias*: the mean signed error over the
  reference's mean. An error near the *noise of the reference* is the reference's own.
- *light paths*: the technique's [path set](path-sets.md); pictures of different sets do not have the same light.

[choosing.md](choosing.md) says when to take which.
END_OF_HEAD
    cat "$work/page"
} >"$page"
