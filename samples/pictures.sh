#!/bin/sh
# Makes the pictures of samples/README.md anew, each by its sample; the viewers' on a virtual X server.
set -eu
cd "$(dirname "$0")/.."
cargo build --release -p clerestory-samples --bins
samples="${CARGO_TARGET_DIR:-target}/release"
out=samples/pictures
"$samples/hello_triangle_offscreen" "$out/hello_triangle_offscreen.png"
"$samples/sort_on_the_gpu" "$out/sort_on_the_gpu.png"
"$samples/embed_headless" "$out/embed_headless.png" --size 240x180 --spp 256
"$samples/embed_host_device" "$out/embed_host_device.png" --size 180x172 --samples 4
"$samples/own_kernel" "$out/own_kernel.png" --size 180x180 --spp 256
beside=$(mktemp -d)
trap 'rm -r "$beside"' EXIT
"$samples/render_gltf" --output "$beside/render_gltf.png" --size 240x180 --spp 256
cp "$beside/render_gltf.png" "$out/"
xvfb-run -a "$samples/viewer" 'builtin:cornell-box?sphere=gold' --size 180x180 --exposure 0.5 --frames 400 --screenshot "$out/viewer.png"
xvfb-run -a "$samples/photon_viewer" --size 240x180 --photons 131072 --spread 16 --exposure -1.5 --frames 12 --screenshot "$out/photon_viewer.png"
"$samples/volume_photons" --picture "$out/volume_photons.png" --size 240x240 --photons 65536 --volume ray --frames 8
xvfb-run -a "$samples/many_lights" --size 180x180 --lights 512 --turn 12 --frames 16 --screenshot "$out/many_lights.png"
"$samples/octahedron_lab" --output "$out/octahedron_lab.png" --size 1000x400 --channel distance --against cube
"$samples/reflection_preview" --output "$out/reflection_preview.png" --size 240x180 --samples 4 --shadow 1024 --frames 5 --search 3
"$samples/mirror_room" "$out/mirror_room.png" --size 180x180 --spp 64
"$samples/metals" "$out/metals.png" --size 240x240 --spp 64
ls -l "$out"
