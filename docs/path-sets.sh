#!/bin/sh
# Renders the pictures of docs/path-sets.md: `docs/path-sets.sh [PROGRAM]`, by default the `clerestory` in the search path.
set -eu
program=${1:-clerestory}
folder=$(dirname "$0")/path-sets
part() {
    "$program" render 'builtin:cornell-box?sphere=glass' --size 192x192 --spp "${SPP:-1024}" --exposure 1 --path-set "$2" \
        -o "$folder/$1.png" --overwrite --stats none
    rm -f "$folder/$1.json"
}
part all 'all'
part emitted 'LE'
part direct 'LDE'
part diffuse 'LD{2,}E'
part caustics 'L.*S.*DE'
part seen-in-glass 'L.*SE'
