#!/usr/bin/env python3
"""Renders an exported scene with Cycles: the mean of independent passes and the variance of that mean.

Writes PREFIX.f32 (mean radiance, then the variance of that mean: 32-bit floats, little-endian, by row from the top, column, channel) and PREFIX.json
(settings, seconds). Each pass has a seed of its own, so passes are independent whatever the sampler does within one.
The Python needs the package bpy, Blender as a module. What a scene holds stands in tools/src/cycles.rs.
"""

import argparse
import json
import os
import sys
import tempfile
import time


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="the exporter's file")
    parser.add_argument("prefix", help="output files without their suffix")
    parser.add_argument("--distribution", default="GGX", choices=["GGX", "MULTI_GGX"], help="of rough surfaces (default %(default)s)")
    parser.add_argument("--passes", type=int, default=128, help="independent passes, at least 2 (default %(default)s)")
    parser.add_argument("--spp", type=int, default=8, help="samples per pixel in each pass (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first pass; pass i takes seed + i")
    arguments = parser.parse_args()
    if arguments.passes < 2 or arguments.spp < 1:
        parser.error("a variance needs at least 2 passes of at least 1 sample")
    return arguments


def settings(scene, described, samples):
    """Path tracing without anything that makes pictures less noisy but wrong: no clamping, no blur, no denoising."""
    cycles = scene.cycles
    scene.render.engine = "CYCLES"
    cycles.device = "CPU"
    # A pixel's first sample lies in its middle, which would shrink the pixel that the others spread over: it is left out.
    cycles.samples = samples + 1
    cycles.use_sample_subset = True
    cycles.sample_offset = 1
    cycles.sample_subset_length = samples
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_light_tree = False
    cycles.light_sampling_threshold = 0.0
    cycles.sample_clamp_direct = 0.0
    cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = True
    cycles.caustics_refractive = True
    cycles.use_fast_gi = False
    for kind in ["max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"]:
        setattr(cycles, kind, described["bounces"])
    cycles.pixel_filter_type = "BOX"
    scene.render.use_persistent_data = True
    width, height = described["size"]
    scene.render.resolution_x = width
    scene.render.resolution_y = height
    scene.render.resolution_percentage = 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "NONE"


def linked(tree, node_kind, inputs, output_kind, properties=()):
    """Makes a node the only one of a tree, and links it to the tree's output."""
    tree.nodes.clear()
    node = tree.nodes.new(node_kind)
    for name, value in properties:
        setattr(node, name, value)
    for name, value in inputs:
        node.inputs[name].default_value = value
    output = tree.nodes.new(output_kind)
    tree.links.new(node.outputs[0], output.inputs["Surface"])


def material(bpy, described, distribution):
    made = bpy.data.materials.new("surface")
    made.use_nodes = True
    kind = described["kind"]
    roughness = described.get("roughness")
    rough = [("distribution", distribution)]
    if kind == "diffuse":
        node, inputs, properties = "ShaderNodeBsdfDiffuse", [("Color", described["color"] + [1.0]), ("Roughness", 0.0)], []
    elif kind == "white_metal":
        node, inputs, properties = "ShaderNodeBsdfAnisotropic", [("Color", [1.0] * 4), ("Roughness", roughness)], rough
    elif kind == "schlick_metal":
        # A white tint of the edge is Schlick's factor.
        inputs = [("Base Color", described["color"] + [1.0]), ("Edge Tint", [1.0] * 4), ("Roughness", roughness)]
        node, properties = "ShaderNodeBsdfMetallic", rough + [("fresnel_type", "F82")]
    elif kind == "conductor":
        inputs = [("IOR", described["eta"]), ("Extinction", described["k"]), ("Roughness", roughness)]
        node, properties = "ShaderNodeBsdfMetallic", rough + [("fresnel_type", "PHYSICAL_CONDUCTOR")]
    elif kind == "glass":
        inputs = [("Color", [1.0] * 4), ("IOR", described["ior"]), ("Roughness", roughness)]
        node, properties = "ShaderNodeBsdfGlass", rough
    else:
        sys.exit(f"no surface is called {kind}")
    linked(made.node_tree, node, inputs, "ShaderNodeOutputMaterial", properties)
    return made


def build(bpy, described, arguments):
    from mathutils import Matrix, Vector

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    settings(scene, described, arguments.spp)

    def add(name, data):
        placed = bpy.data.objects.new(name, data)
        scene.collection.objects.link(placed)
        return placed

    for mesh in described["meshes"]:
        data = bpy.data.meshes.new("mesh")
        data.from_pydata(mesh["positions"], [], mesh["triangles"])
        data.materials.append(material(bpy, mesh["surface"], arguments.distribution))
        add("mesh", data)
    for sun in described["suns"]:
        light = bpy.data.lights.new("sun", "SUN")
        light.angle = 0.0
        light.energy = 1.0
        light.color = sun["irradiance"]
        placed = add("sun", light)
        placed.rotation_mode = "QUATERNION"
        # It shines along its −Z.
        placed.rotation_quaternion = Vector([-x for x in sun["direction"]]).to_track_quat("Z", "Y")

    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    sky = [("Color", described["sky"] + [1.0]), ("Strength", 1.0)]
    linked(world.node_tree, "ShaderNodeBackground", sky, "ShaderNodeOutputWorld")
    scene.world = world

    seen = described["camera"]
    camera = bpy.data.cameras.new("camera")
    # Cycles does not clip by default distances that small scenes reach.
    camera.clip_start, camera.clip_end = 1e-4, 1e6
    camera.sensor_fit = "VERTICAL"
    if seen["fov_y"] is not None:
        camera.type = "PERSP"
        camera.angle_y = seen["fov_y"]
    else:
        camera.type = "ORTHO"
        camera.ortho_scale = 2.0 * seen["half_height"]
    placed = add("camera", camera)
    placed.matrix_world = Matrix(seen["to_world"] + [[0.0, 0.0, 0.0, 1.0]])
    scene.camera = placed
    return scene


def main():
    arguments = parse_arguments()
    import bpy
    import numpy

    with open(arguments.scene, encoding="utf-8") as file:
        described = json.load(file)
    scene = build(bpy, described, arguments)
    width, height = described["size"]

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "pass.exr")

        def render(seed):
            scene.cycles.seed = seed & 0x7FFFFFFF
            scene.render.filepath = path
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(path)
            image.colorspace_settings.name = "Non-Color"
            values = numpy.empty(width * height * 4, dtype=numpy.float32)
            image.pixels.foreach_get(values)
            bpy.data.images.remove(image)
            # Blender's rows begin at the bottom.
            return values.reshape(height, width, 4)[::-1, :, :3].astype(numpy.float64)

        # Welford's update: no cancellation between large sums.
        mean, squares, start = 0.0, 0.0, time.perf_counter()
        for index in range(arguments.passes):
            picture = render(arguments.seed + index)
            difference = picture - mean
            mean = mean + difference / (index + 1)
            squares = squares + difference * (picture - mean)
        seconds = time.perf_counter() - start
    variance_of_mean = squares / (arguments.passes - 1) / arguments.passes

    layers = numpy.stack([mean, variance_of_mean]).astype("<f4")
    layers.tofile(arguments.prefix + ".f32")
    report = {
        "renderer": "cycles " + bpy.app.version_string,
        "scene": os.path.basename(arguments.scene),
        "distribution": arguments.distribution,
        "width": width,
        "height": height,
        "passes": arguments.passes,
        "spp_per_pass": arguments.spp,
        "seed": arguments.seed,
        "seconds": seconds,
        "non_finite_values": int(numpy.count_nonzero(~numpy.isfinite(layers))),
    }
    with open(arguments.prefix + ".json", "w", encoding="utf-8") as file:
        file.write(json.dumps(report, indent=2, allow_nan=False) + "\n")


if __name__ == "__main__":
    main()
