#!/usr/bin/env python3
"""Traces photons through an exported scene with another renderer and prints as JSON how long it took.

mitsuba: the particle tracer (`ptracer`) of Mitsuba 3, which also joins every vertex of a light path to the camera.
luxcore: the photon cache for indirect light (PhotonGI) of LuxCore; times are those of its log, whose clock ticks in milliseconds. It takes
scenes of diffuse surfaces and area lights alone.

Printed: version; of each round but a first one that does not count: photons, landings kept where the renderer tells, seconds of tracing and
of making what answers queries.
"""

import argparse
import json
import os
import re
import sys
import time
import xml.etree.ElementTree

ROULETTE_DEPTH = 5


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("peer", choices=["mitsuba", "luxcore"])
    parser.add_argument("scene", help="scene.xml of the exporter")
    parser.add_argument("--photons", type=int, default=1 << 17, help="a round (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=3, help="that count (default %(default)s)")
    parser.add_argument("--depth", type=int, default=8, help="edges of a light path at most (default %(default)s)")
    return parser.parse_args()


def trace_with_mitsuba(arguments):
    # Of this folder.
    from reference import find_llvm

    llvm = find_llvm()
    if llvm:
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import mitsuba
    import numpy

    mitsuba.set_variant("llvm_ad_rgb" if llvm else "scalar_rgb")
    scene = mitsuba.load_file(arguments.scene)
    width, height = scene.sensors()[0].film().size()
    samples = max(arguments.photons // (width * height), 1)
    integrator = mitsuba.load_dict({"type": "ptracer", "max_depth": arguments.depth + 1, "rr_depth": ROULETTE_DEPTH})
    seconds = []
    for seed in range(arguments.rounds + 1):
        start = time.perf_counter()
        # Reading the picture waits for it.
        numpy.array(integrator.render(scene, seed=seed, spp=samples))
        seconds.append(time.perf_counter() - start)
    return {
        "version": f"Mitsuba {mitsuba.__version__}, {mitsuba.variant()}",
        "photons": [samples * width * height] * arguments.rounds,
        "landings": None,
        "trace_seconds": seconds[1:],
        "map_seconds": None,
    }


def numbers(element):
    return [float(word) for word in element.get("value").split()]


def put_volume(put, name, index_of_refraction, absorption=(0.0, 0.0, 0.0), scattering=(0.0, 0.0, 0.0)):
    """A volume of LuxCore's that scatters alike in all directions, or not at all."""
    scatters = any(scattering)
    put(f"scene.volumes.{name}.type", "homogeneous" if scatters else "clear")
    put(f"scene.volumes.{name}.ior", index_of_refraction)
    put(f"scene.volumes.{name}.absorption", list(absorption))
    if scatters:
        put(f"scene.volumes.{name}.scattering", list(scattering))
        put(f"scene.volumes.{name}.asymmetry", [0.0] * 3)
        put(f"scene.volumes.{name}.multiscattering", 1)


def put_media(put, root):
    """The scene's media, and air; the name of the last medium, if there is one."""
    put_volume(put, "air", 1.0)
    last = None
    for medium in root.findall("medium"):
        if medium.get("type") != "homogeneous" or medium.find("phase").get("type") != "isotropic":
            sys.exit("media with a grid or a direction are not carried over")
        scale = float(medium.find("float[@name='scale']").get("value"))
        extinction = [scale * value for value in numbers(medium.find("rgb[@name='sigma_t']"))]
        scattering = [t * a for t, a in zip(extinction, numbers(medium.find("rgb[@name='albedo']")))]
        last = medium.get("id")
        put_volume(put, last, 1.0, [t - s for t, s in zip(extinction, scattering)], scattering)
    return last


def put_clear(put, index, shape):
    """Smooth glass or an invisible boundary, with what lies on both of its sides; whether the shape is one."""
    kinds = {bsdf.get("type") for bsdf in shape.iter("bsdf")}
    if kinds not in ({"null"}, {"dielectric"}):
        return False
    material = f"scene.materials.m{index}"
    sides = {side.get("name"): side.get("id") for side in shape.findall("ref")}
    inside = sides.get("interior", "air")
    if kinds == {"dielectric"}:
        inside = f"glass{index}"
        put_volume(put, inside, float(shape.find("bsdf/float[@name='int_ior']").get("value")))
        put(f"{material}.type", "glass")
        put(f"{material}.kr", [1.0] * 3)
        put(f"{material}.kt", [1.0] * 3)
    else:
        put(f"{material}.type", "null")
    put(f"{material}.volume.interior", inside)
    put(f"{material}.volume.exterior", sides.get("exterior", "air"))
    return True


def luxcore_scene(pyluxcore, path, clear=False):
    """The exported scene, of diffuse surfaces and area lights.

    With `clear` also of smooth glass and of media without a grid that scatter alike in all directions; all lights then lie in the last medium, since
    light there begins in the volume that its surface names.
    """
    root = xml.etree.ElementTree.parse(path).getroot()
    properties = pyluxcore.Properties()

    def put(key, value):
        properties.Set(pyluxcore.Property(key, value))

    matrix = numbers(root.find("sensor/transform/matrix"))
    position = [matrix[3], matrix[7], matrix[11]]
    put("scene.camera.type", "perspective")
    put("scene.camera.lookat.orig", position)
    put("scene.camera.lookat.target", [position[i] + matrix[4 * i + 2] for i in range(3)])
    put("scene.camera.up", [matrix[4 * i + 1] for i in range(3)])
    put("scene.camera.fieldofview", float(root.find("sensor/float[@name='fov']").get("value")))
    if root.find("emitter") is not None:
        sys.exit("lights without area are not carried over")
    medium = put_media(put, root) if clear else None
    for index, shape in enumerate(root.findall("shape")):
        name = shape.find("string[@name='filename']").get("value")
        put(f"scene.objects.o{index}.ply", os.path.join(os.path.dirname(path), name))
        put(f"scene.objects.o{index}.material", f"m{index}")
        if clear and put_clear(put, index, shape):
            continue
        kinds = {bsdf.get("type") for bsdf in shape.iter("bsdf")}
        colour = shape.find(".//bsdf[@type='diffuse']/rgb[@name='reflectance']")
        if not kinds <= {"diffuse", "twosided"} or colour is None:
            sys.exit("surfaces that are not diffuse are not carried over")
        put(f"scene.materials.m{index}.type", "matte")
        put(f"scene.materials.m{index}.kd", numbers(colour))
        radiance = shape.find("emitter[@type='area']/rgb")
        if radiance is not None:
            put(f"scene.materials.m{index}.emission", numbers(radiance))
        if medium:
            put(f"scene.materials.m{index}.volume.exterior", medium)
    scene = pyluxcore.Scene()
    scene.Parse(properties)
    return scene


def trace_with_luxcore(arguments):
    import pyluxcore

    log = []
    pyluxcore.Init(log.append)
    scene = luxcore_scene(pyluxcore, arguments.scene)
    settings = {
        "renderengine.type": "PATHCPU",
        "sampler.type": "SOBOL",
        "film.width": 64,
        "film.height": 64,
        "path.photongi.sampler.type": "RANDOM",
        "path.photongi.photon.maxcount": arguments.photons,
        "path.photongi.photon.maxdepth": arguments.depth,
        "path.photongi.photon.time.start": 0.0,
        "path.photongi.photon.time.end": -1.0,
        "path.photongi.indirect.enabled": 1,
        # More than can land, so that the number of photons alone ends it.
        "path.photongi.indirect.maxsize": 4 * arguments.photons * arguments.depth,
        "path.photongi.indirect.haltthreshold": 0.0,
        # Found by it.
        "path.photongi.indirect.lookup.radius": 0.0,
        "path.photongi.caustic.enabled": 0,
        "path.photongi.debug.type": "showindirect",
        "batch.haltspp": 1,
    }
    properties = pyluxcore.Properties()
    for key, value in settings.items():
        properties.Set(pyluxcore.Property(key, value))
    trace, build, photons, landings = [], [], [], []
    for _ in range(arguments.rounds + 1):
        log.clear()
        session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties, scene))
        session.Start()
        session.Stop()

        def at(text):
            """The second of the log's first line with the text, and the number at its end."""
            for line in log:
                found = re.search(r"\[([0-9.]+)\] " + re.escape(text) + r":? ?(\d*)", line)
                if found:
                    return float(found[1]), int(found[2] or 0)
            sys.exit(f"LuxCore's log has no line '{text}'")

        begun, _ = at("PhotonGI tracing indirect cache photons")
        _, landed = at("PhotonGI additional indirect photon stored")
        traced, emitted = at("PhotonGI total photon traced")
        done, _ = at("PhotonGI total memory usage")
        photons.append(emitted)
        landings.append(landed)
        trace.append(traced - begun)
        build.append(done - traced)
    return {
        "version": f"LuxCore {pyluxcore.Version()}, Embree",
        "photons": photons[1:],
        "landings": landings[1:],
        "trace_seconds": trace[1:],
        "map_seconds": build[1:],
    }


def main():
    arguments = parse_arguments()
    trace = {"mitsuba": trace_with_mitsuba, "luxcore": trace_with_luxcore}[arguments.peer]
    # What libraries print is none of the answer.
    out = os.dup(1)
    os.dup2(2, 1)
    answer = trace(arguments)
    sys.stdout.flush()
    os.write(out, (json.dumps(answer) + "\n").encode())
    # LuxCore still logs while the interpreter ends, which then aborts.
    os._exit(0)


if __name__ == "__main__":
    main()
