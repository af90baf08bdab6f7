#!/usr/bin/env python3
"""Renders an exported scene by LuxCore's bidirectional path tracer (BIDIRCPU), or its path tracer, and prints as JSON how long it took.

It takes scenes of diffuse surfaces and area lights, with --clear also of smooth glass and of homogeneous media that scatter alike in all directions. Each
picture has samples of its own; all are written one behind the other to a file, three values of 32 bits a pixel, the top row first.

Printed: version; of each picture but a first one that does not count: seconds of rendering.
"""

import argparse
import array
import json
import os
import sys
import time

# Beyond these edges of an eye path or a light path there is next to no light in closed rooms.
DEPTH = 32


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="scene.xml of the exporter")
    parser.add_argument("pictures_file", help="where the pictures go")
    parser.add_argument("--size", type=int, default=64, help="pixels along a side (default %(default)s)")
    parser.add_argument("--samples", type=int, default=16, help="of a pixel (default %(default)s)")
    parser.add_argument("--pictures", type=int, default=3, help="that count (default %(default)s)")
    parser.add_argument("--engine", choices=["BIDIRCPU", "PATHCPU"], default="BIDIRCPU", help="(default %(default)s)")
    parser.add_argument("--depth", type=int, default=DEPTH, help="edges of a path from either end at most (default %(default)s)")
    parser.add_argument("--clear", action="store_true", help="take glass and media too")
    parser.add_argument("--no-roulette", action="store_true", help="follow all paths to the depth")
    parser.add_argument("--seed", type=int, default=1, help="of the first picture (default %(default)s)")
    return parser.parse_args()


def render(pyluxcore, scene, arguments, seed):
    """Values of a picture, and the seconds that it took."""
    settings = {
        "renderengine.type": arguments.engine,
        "renderengine.seed": seed,
        "sampler.type": "RANDOM",
        "path.maxdepth": arguments.depth,
        "light.maxdepth": arguments.depth,
        "path.pathdepth.total": arguments.depth,
        "path.pathdepth.diffuse": arguments.depth,
        "path.pathdepth.glossy": arguments.depth,
        "path.pathdepth.specular": arguments.depth,
        "film.width": arguments.size,
        "film.height": arguments.size,
        "film.filter.type": "NONE",
        "film.opencl.enable": 0,
        # Linear radiance.
        "film.imagepipelines.0.0.type": "NOP",
        "film.outputs.0.type": "RGB_IMAGEPIPELINE",
        "film.outputs.0.index": 0,
        "film.outputs.0.filename": "unused.exr",
        "batch.haltspp": arguments.samples,
    }
    if arguments.no_roulette:
        settings["path.russianroulette.cap"] = 1.0
    properties = pyluxcore.Properties()
    for key, value in settings.items():
        properties.Set(pyluxcore.Property(key, value))
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties, scene))
    begun = time.perf_counter()
    session.Start()
    while not session.HasDone():
        time.sleep(0.002)
        session.UpdateStats()
    seconds = time.perf_counter() - begun
    session.Stop()
    values = array.array("f", [0.0] * (3 * arguments.size * arguments.size))
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB_IMAGEPIPELINE, values, 0)
    row = 3 * arguments.size
    # Its rows begin below.
    rows = [values[start : start + row] for start in range(0, len(values), row)]
    return b"".join(one.tobytes() for one in reversed(rows)), seconds


def main():
    arguments = parse_arguments()
    # What libraries print is none of the answer.
    out = os.dup(1)
    os.dup2(2, 1)
    import pyluxcore

    # Of this folder.
    from photons import luxcore_scene

    pyluxcore.Init(lambda line: None)
    scene = luxcore_scene(pyluxcore, arguments.scene, arguments.clear)
    seconds = []
    with open(arguments.pictures_file, "wb") as file:
        for picture in range(arguments.pictures + 1):
            values, took = render(pyluxcore, scene, arguments, arguments.seed + picture)
            if picture > 0:
                file.write(values)
                seconds.append(took)
    answer = {"version": f"LuxCore {pyluxcore.Version()}, Embree", "seconds": seconds}
    os.write(out, (json.dumps(answer) + "\n").encode())
    # LuxCore still logs while the interpreter ends, which then aborts.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
