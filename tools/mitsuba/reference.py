#!/usr/bin/env python3
"""Renders an exported scene with Mitsuba 3: the mean of independent passes and the variance of that mean.

Writes PREFIX.exr (channels R, G, B: mean radiance; variance.R, variance.G, variance.B: variance of the mean, per channel) and PREFIX.json
(settings, seconds, paths per second). Each pass has a seed of its own, so passes are independent whatever the sampler does within one.
With --each the passes themselves go to PREFIX.f32: 32-bit floats, little-endian, by pass, row, column, channel.
"""

import argparse
import ctypes.util
import glob
import json
import math
import os
import sys
import time
import xml.etree.ElementTree


def find_llvm():
    """LLVM 19 where Debian's libllvm19 puts it; Mitsuba 3.9 aborts with 14 and 15."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return os.environ["DRJIT_LIBLLVM_PATH"]
    found = sorted(glob.glob("/usr/lib/*/libLLVM*19*"))
    return found[0] if found else ctypes.util.find_library("LLVM-19")


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="scene.xml of the exporter")
    parser.add_argument("prefix", help="output files without their suffix")
    parser.add_argument("--variant", default="auto", choices=["auto", "scalar_rgb", "llvm_ad_rgb"], help="auto: LLVM when it is there")
    parser.add_argument("--passes", type=int, default=64, help="independent passes, at least 2 (default %(default)s)")
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel in each pass (default %(default)s)")
    parser.add_argument("--sampler", default="independent", choices=["independent", "stratified", "multijitter", "orthogonal", "ldsampler"])
    parser.add_argument("--seed", type=int, default=0, help="seed of the first pass; pass i takes seed + i, modulo 2^32")
    parser.add_argument("--integrator", choices=["path", "volpath", "volpathmis"], help="in place of the scene's")
    parser.add_argument("--each", action="store_true", help="also writes every pass, to PREFIX.f32")
    parser.add_argument("--max-depth", type=int, default=-1, help="path length limit in edges, -1 for none")
    parser.add_argument("--rr-depth", type=int, default=5, help="edges before Russian roulette")
    arguments = parser.parse_args()
    if arguments.passes < 2 or arguments.spp < 1:
        parser.error("a variance needs at least 2 passes of at least 1 sample")
    return arguments


def set_variant(mitsuba, wanted):
    """Sets the variant and returns its name; auto falls back to scalar where LLVM is missing."""
    llvm = find_llvm()
    if wanted == "auto":
        wanted = "llvm_ad_rgb" if llvm else "scalar_rgb"
    if wanted == "llvm_ad_rgb" and llvm is None:
        sys.exit("llvm_ad_rgb needs LLVM 19 (Debian: libllvm19), or its path in DRJIT_LIBLLVM_PATH")
    mitsuba.set_variant(wanted)
    return wanted


def finite_or_null(number):
    """JSON has no number that is not finite."""
    return number if math.isfinite(number) else None


def main():
    arguments = parse_arguments()
    llvm = find_llvm()
    if llvm:
        os.environ["DRJIT_LIBLLVM_PATH"] = llvm
    import mitsuba
    import numpy

    variant = set_variant(mitsuba, arguments.variant)
    scene = mitsuba.load_file(arguments.scene, sampler=arguments.sampler, spp=arguments.spp)
    # The exporter's file names an integrator that can hold its media.
    kind = arguments.integrator or xml.etree.ElementTree.parse(arguments.scene).getroot().find("integrator").get("type")
    integrator = mitsuba.load_dict({"type": kind, "max_depth": arguments.max_depth, "rr_depth": arguments.rr_depth})

    def render(seed):
        # The conversion waits for the result, so that the clock sees the work. Mitsuba's seeds have 32 bits.
        picture = mitsuba.render(scene, integrator=integrator, spp=arguments.spp, seed=seed & 0xFFFFFFFF)
        return numpy.array(picture, dtype=numpy.float64)

    # The first pass is not counted: LLVM compiles its kernels in it, and every variant starts threads and touches its memory.
    start = time.perf_counter()
    render(arguments.seed + arguments.passes)
    first_seconds = time.perf_counter() - start

    # Welford's update: no cancellation between large sums.
    mean, squares, seconds, each, cpu_start = 0.0, 0.0, [], [], time.process_time()
    for index in range(arguments.passes):
        start = time.perf_counter()
        picture = render(arguments.seed + index)
        seconds.append(time.perf_counter() - start)
        difference = picture - mean
        mean = mean + difference / (index + 1)
        squares = squares + difference * (picture - mean)
        if arguments.each:
            each.append(picture)
    cpu_seconds = time.process_time() - cpu_start
    variance_of_mean = squares / (arguments.passes - 1) / arguments.passes

    height, width, _ = mean.shape
    names = ["R", "G", "B", "variance.R", "variance.G", "variance.B"]
    layers = numpy.concatenate([mean, variance_of_mean], axis=2).astype(numpy.float32)
    bitmap = mitsuba.Bitmap(layers, pixel_format=mitsuba.Bitmap.PixelFormat.MultiChannel, channel_names=names)
    bitmap.write(arguments.prefix + ".exr")

    if arguments.each:
        numpy.stack(each).astype("<f4").tofile(arguments.prefix + ".f32")

    total = sum(seconds)
    report = {
        "renderer": "mitsuba " + mitsuba.__version__,
        "variant": variant,
        "scene": os.path.basename(arguments.scene),
        "width": width,
        "height": height,
        "integrator": kind,
        "sampler": arguments.sampler,
        "passes": arguments.passes,
        "spp_per_pass": arguments.spp,
        "spp": arguments.passes * arguments.spp,
        "seed": arguments.seed,
        "max_depth": arguments.max_depth,
        "rr_depth": arguments.rr_depth,
        "threads": os.cpu_count(),
        "first_pass_seconds": first_seconds,
        "seconds": total,
        "seconds_each": seconds,
        "cpu_seconds": cpu_seconds,
        "seconds_median_pass": sorted(seconds)[len(seconds) // 2],
        "paths_per_second": width * height * arguments.spp * arguments.passes / total,
        "non_finite_values": int(numpy.count_nonzero(~numpy.isfinite(layers))),
        "mean_radiance": [finite_or_null(band) for band in mean.mean(axis=(0, 1)).tolist()],
    }
    text = json.dumps(report, indent=2, allow_nan=False)
    with open(arguments.prefix + ".json", "w", encoding="utf-8") as file:
        file.write(text + "\n")
    print(text)


if __name__ == "__main__":
    main()
