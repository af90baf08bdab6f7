//! Runs the samples as a reader would, under the validation layers, and looks at what they write.

use std::path::Path;
use std::process::{Command, Output};

/// What the process said, for failures.
fn said(output: &Output) -> String {
    format!(
        "{}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

fn open(path: &Path) -> image::RgbImage {
    image::open(path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .into_rgb8()
}

/// Mean of the display values, red, green and blue, of a part of a picture given by shares of its sides.
fn mean(picture: &image::RgbImage, across: [f32; 2], down: [f32; 2]) -> [f32; 3] {
    let (width, height) = picture.dimensions();
    let range = |share: [f32; 2], side: u32| (share[0] * side as f32) as u32..(share[1] * side as f32) as u32;
    let (mut sum, mut count) = ([0.0; 3], 0.0f32);
    for y in range(down, height) {
        for x in range(across, width) {
            let pixel = picture.get_pixel(x, y).0;
            (0..3).for_each(|c| sum[c] += f32::from(pixel[c]));
            count += 1.0;
        }
    }
    sum.map(|sum| sum / count.max(1.0))
}

/// The Cornell box as everybody knows it: a red wall at the left, a green one at the right, a lamp in the ceiling, light on the back wall.
fn assert_cornell_box(picture: &image::RgbImage) {
    let colours: std::collections::BTreeSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
    assert!(colours.len() > 100, "only {} colours", colours.len());
    // Under the warm lamp (radiance 17, 12, 4) the red wall reflects red and green 13.7 : 1, a display ratio of 3.3, and the green wall
    // 1 : 2.3, a display ratio of 1.45; light from the other walls makes both a little less pure.
    let [red, green] = [[0.04, 0.18], [0.82, 0.96]].map(|across| mean(picture, across, [0.3, 0.7]));
    assert!(red[0] > 2.0 * red[1], "red wall {red:?}");
    assert!(green[1] > 1.2 * green[0], "green wall {green:?}");
    let [left, right] = [[0.0, 1.0 / 3.0], [2.0 / 3.0, 1.0]].map(|across| mean(picture, across, [0.0, 1.0]));
    assert!(
        left[0] * right[1] > 1.2 * right[0] * left[1],
        "thirds {left:?} {right:?}"
    );
    let lamp = mean(picture, [0.48, 0.52], [0.13, 0.155]);
    assert!(lamp.iter().all(|value| *value > 200.0), "lamp {lamp:?}");
    let back = mean(picture, [0.4, 0.6], [0.3, 0.4]);
    assert!(back[0] > 30.0 && back[0] < 2.0 * back[1], "back wall {back:?}");
}

/// Its walls alone, whatever lights them.
fn assert_cornell_walls(picture: &image::RgbImage) {
    let [red, green] = [[0.04, 0.14], [0.86, 0.96]].map(|across| mean(picture, across, [0.3, 0.7]));
    assert!(red[0] > 1.5 * red[1] && green[1] > 1.2 * green[0], "{red:?} {green:?}");
}

/// Runs a sample under the validation layers; fails when it does.
fn run(program: &str, arguments: &[&str]) -> Output {
    let output = Command::new(program)
        .args(arguments)
        .env("CLERESTORY_VALIDATION", "core")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    output
}

/// Runs a sample that writes one picture and takes its path as argument.
fn picture_of(program: &str, arguments: &[&str]) -> image::RgbImage {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new folder/picture.png");
    run(program, &[&[path.to_str().unwrap()], arguments].concat());
    open(&path)
}

#[test]
fn hello_triangle_offscreen_draws_its_corners() {
    let picture = picture_of(env!("CARGO_BIN_EXE_hello_triangle_offscreen"), &[]);
    assert_eq!(picture.dimensions(), (512, 512));
    let dominant = |x, y| {
        let pixel = picture.get_pixel(x, y).0;
        (0..3).max_by_key(|channel| pixel[*channel]).unwrap()
    };
    // Near the corners red (top), green (right) and blue (left); outside the triangle the background.
    assert_eq!([dominant(256, 80), dominant(430, 395), dominant(80, 395)], [0, 1, 2]);
    assert_eq!(picture.get_pixel(10, 10), picture.get_pixel(500, 500));
    assert_ne!(picture.get_pixel(10, 10), picture.get_pixel(256, 256));
}

#[test]
fn sort_on_the_gpu_sorts_its_colours() {
    let picture = picture_of(env!("CARGO_BIN_EXE_sort_on_the_gpu"), &[]);
    assert_eq!(picture.dimensions(), (512, 512));
    let luma = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let bands: Vec<f32> = (0..8)
        .map(|band| {
            luma(mean(
                &picture,
                [0.0, 1.0],
                [0.5 + band as f32 / 16.0, 0.5 + (band + 1) as f32 / 16.0],
            ))
        })
        .collect();
    assert!(bands.is_sorted() && bands[7] > bands[0] + 100.0, "{bands:?}");
    // The colours above are not sorted, and are the same ones.
    let mut halves: Vec<_> = picture
        .as_raw()
        .chunks(3 * 512 * 256)
        .map(|half| half.as_chunks::<3>().0.to_vec())
        .collect();
    halves.iter_mut().for_each(|half| half.sort());
    assert!(halves[0] == halves[1]);
    let above = [[0.0, 0.1], [0.4, 0.5]].map(|down| luma(mean(&picture, [0.0, 1.0], down)));
    assert!((above[0] - above[1]).abs() < 30.0, "{above:?}");
}

#[test]
fn embed_headless_renders_its_balls() {
    let options = ["--size", "64x48", "--spp", "8"];
    let picture = picture_of(env!("CARGO_BIN_EXE_embed_headless"), &options);
    assert_eq!(picture.dimensions(), (64, 48));
    let sky = mean(&picture, [0.0, 1.0], [0.0, 0.15]);
    assert!(sky[2] > 1.1 * sky[0] && sky[0] > 20.0, "sky {sky:?}");
    let red = mean(&picture, [0.2, 0.35], [0.35, 0.6]);
    assert!(red[0] > 2.0 * red[1], "red ball {red:?}");
    // The metal is yellowish, and its own colour shows in the floor's reflection.
    let metal = mean(&picture, [0.65, 0.8], [0.55, 0.7]);
    assert!(metal[1] > 1.05 * metal[2], "metal ball {metal:?}");
}

#[test]
fn embed_host_device_shows_the_cornell_box_over_sorted_greys() {
    let options = ["--size", "64x64", "--samples", "2"];
    let picture = picture_of(env!("CARGO_BIN_EXE_embed_host_device"), &options);
    assert_eq!(picture.dimensions(), (64, 72));
    let shown = image::imageops::crop_imm(&picture, 0, 0, 64, 64).to_image();
    assert_cornell_box(&shown);
    let greys: Vec<u8> = (64..72)
        .flat_map(|y| (0..64).map(move |x| (x, y)))
        .map(|(x, y)| picture.get_pixel(x, y).0[0])
        .collect();
    assert!(greys.is_sorted() && greys[0] < 10 && greys[511] > 245, "{greys:?}");
}

#[test]
fn own_kernel_draws_edges_and_darkens_corners() {
    let options = ["--size", "64x64", "--spp", "8"];
    let picture = picture_of(env!("CARGO_BIN_EXE_own_kernel"), &options);
    assert_eq!(picture.dimensions(), (64, 64));
    // The lamp is as bright as before, and its edge is ink.
    let lamp = mean(&picture, [0.48, 0.52], [0.13, 0.155]);
    assert!(lamp[0] > 150.0, "lamp {lamp:?}");
    let inked = picture
        .pixels()
        .filter(|pixel| {
            let [red, green, blue] = pixel.0.map(u32::from);
            blue > 2 * red.max(green).max(10)
        })
        .count();
    assert!(inked > 20, "{inked} pixels of ink");
    // A mistake is an error with its line, before anything is rendered.
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("kernel.wgsl");
    std::fs::write(&source, "@compute @workgroup_size(1)\nfn main() {\n    missing();\n}\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_own_kernel"))
        .args(["--source", source.to_str().unwrap()])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && text.contains("line 3, column 5"), "{text}");
}

#[test]
fn render_gltf_shows_its_own_file_with_the_texture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/picture.png");
    let options = ["--output", path.to_str().unwrap(), "--size", "80x60", "--spp", "8"];
    let output = run(env!("CARGO_BIN_EXE_render_gltf"), &options);
    let text = String::from_utf8_lossy(&output.stdout);
    for expected in [
        "8 triangles",
        "textures",
        "left out:",
        "8 samples per pixel",
        "path: shade",
        "picture.exr",
    ] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (80, 60));
    let pyramid = mean(&picture, [0.42, 0.58], [0.45, 0.65]);
    assert!(pyramid[0] > 2.0 * pyramid[2], "pyramid {pyramid:?}");
    assert_eq!(mean(&picture, [0.0, 1.0], [0.0, 0.2]), [0.0; 3]);
    // The texture's squares along a row of the floor: blue ones and cream ones.
    let row = |warm: bool| {
        (0..80)
            .filter(|x| {
                let [r, _, b] = picture.get_pixel(*x, 56).0;
                if warm { r > b && r > 60 } else { b > r && b > 30 }
            })
            .count()
    };
    assert!(row(true) > 20 && row(false) > 20, "{} {}", row(true), row(false));
    let exr = clerestory::film::exr::read(path.with_extension("exr")).unwrap();
    assert_eq!((exr.width(), exr.height()), (80, 60));
    assert!(exr.layer("radiance").is_some() && exr.metadata.spp == Some(8));
}

#[test]
fn render_gltf_names_what_it_cannot_read() {
    let output = Command::new(env!("CARGO_BIN_EXE_render_gltf"))
        .arg("no/such/scene.gltf")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("no/such/scene.gltf"), "{}", said(&output));
}

#[test]
fn a_sample_that_cannot_write_says_so() {
    let output = Command::new(env!("CARGO_BIN_EXE_embed_headless"))
        .args(["/dev/null/picture.png", "--size", "8x8", "--spp", "1"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("/dev/null"), "{error}");
    assert!(!error.contains("panicked"), "{error}");
}

/// The viewer on a virtual X server.
fn viewer(arguments: &[&str], screenshot: &Path) -> Output {
    windowed(env!("CARGO_BIN_EXE_viewer"), arguments, screenshot)
}

/// A sample with a window on a virtual X server.
fn windowed(program: &str, arguments: &[&str], screenshot: &Path) -> Output {
    Command::new("xvfb-run")
        .args(["-a", program])
        .args(arguments)
        .arg("--screenshot")
        .arg(screenshot)
        .env("CLERESTORY_VALIDATION", "core")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .unwrap_or_else(|error| {
            panic!("cannot run xvfb-run ({error}): install it (Debian: apt-get install xvfb xauth)")
        })
}

#[test]
fn the_viewer_shows_the_cornell_box_and_resizes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("first.png");
    let output = viewer(&["--size", "160x160", "--frames", "6"], &path);
    assert!(output.status.success(), "{}", said(&output));
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (160, 160));
    assert_cornell_box(&picture);

    // Without a window manager a new size is there after some frames.
    let path = folder.path().join("second.png");
    let options = ["--size", "100x100", "--frames", "30", "--resize", "150x150"];
    let output = viewer(&options, &path);
    assert!(output.status.success(), "{}", said(&output));
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (150, 150));
    assert_cornell_box(&picture);
}

#[test]
fn the_viewer_exposes_by_stops() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let back = |stops: &str| {
        let output = viewer(&["--size", "64x64", "--frames", "2", "--exposure", stops], &path);
        assert!(output.status.success(), "{}", said(&output));
        mean(&open(&path), [0.4, 0.6], [0.3, 0.4])[0]
    };
    // Two stops are a factor of 4 in light, about 1.8 in display values.
    let (dark, bright) = (back("-1"), back("1"));
    assert!(bright > 1.5 * dark, "{dark} {bright}");
}

#[test]
fn the_viewer_takes_orthographic_cameras_and_models_without_any() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    // A slab of glass in a uniform environment is invisible but for what is absorbed: all is bright.
    let output = viewer(&["builtin:slab", "--size", "48x48", "--frames", "2"], &path);
    assert!(output.status.success(), "{}", said(&output));
    assert!(mean(&open(&path), [0.0, 1.0], [0.0, 1.0])[1] > 100.0);

    // A triangle without camera and light gets both: the picture shows the model before a bright environment.
    let model = folder.path().join("triangle.obj");
    std::fs::write(&model, "v -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n").unwrap();
    let output = viewer(&[model.to_str().unwrap(), "--size", "48x48", "--frames", "2"], &path);
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("no camera in the file"), "{}", said(&output));
    let picture = open(&path);
    assert_eq!(picture.get_pixel(1, 1).0, [255; 3]);
    assert!(picture.get_pixel(24, 26).0[0] < 255, "{:?}", picture.get_pixel(24, 26));
}

#[test]
fn the_viewer_goes_through_the_techniques() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let shown = |arguments: &[&str]| {
        let output = viewer(&[arguments, &["--size", "48x48", "--frames", "4"]].concat(), &path);
        assert!(output.status.success(), "{}", said(&output));
        (mean(&open(&path), [0.0, 1.0], [0.0, 1.0]), said(&output))
    };
    let lit = "builtin:cornell-box?source=point";
    let (path_traced, text) = shown(&[lit]);
    assert!(text.contains("path, "), "{text}");
    let (drawn, text) = shown(&[lit, "--technique", "photon", "--keys", "T"]);
    assert!(text.contains("preview, "), "{text}");
    // Direct light alone.
    assert!(
        drawn[1] > 10.0 && drawn[1] < path_traced[1],
        "{drawn:?} {path_traced:?}"
    );
    // Around, from the last one.
    let (_, text) = shown(&[lit, "--technique", "many-light", "--keys", "t"]);
    assert!(text.contains("path, "), "{text}");
    // What cannot render the scene is left out: of media, all but the path tracer, bidirectional paths, photon mapping and virtual lights.
    for (keys, technique) in [
        ("t", "photon, "),
        ("tt", "vpl, "),
        ("ttt", "bdpt, "),
        ("tttt", "path, "),
    ] {
        let (_, text) = shown(&["builtin:fog-box", "--keys", keys]);
        assert!(text.contains(technique), "{keys}: {text}");
    }
}

#[test]
fn the_viewer_refuses_what_it_does_not_know() {
    for arguments in [
        ["--frames", "many"],
        ["--resize", "wide"],
        ["--exposure", "bright"],
        ["--colour", "red"],
        ["builtin:nowhere", "--frames"],
        ["builtin:cornell-box", "builtin:ring"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_viewer"))
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(error.contains(arguments[0]) || error.contains(arguments[1]), "{error}");
    }
}

/// The last frame of `many_lights`, and what it said.
fn many_lights(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let arguments = [&["--size", "64x64", "--lights", "64"], arguments].concat();
    let output = windowed(env!("CARGO_BIN_EXE_many_lights"), &arguments, &path);
    assert!(output.status.success(), "{}", said(&output));
    (open(&path), said(&output))
}

#[test]
fn the_lamp_of_many_lights_goes_around() {
    for placement in ["walks", "incremental"] {
        // The ceiling above the lamp.
        let sides = |frames: &str| {
            let (picture, _) = many_lights(&["--turn", "90", "--frames", frames, "--placement", placement]);
            [[0.15, 0.45], [0.55, 0.85]].map(|across| mean(&picture, across, [0.04, 0.2])[1])
        };
        let [first, third] = ["1", "3"].map(sides);
        // The circle begins at the left of the picture, and half a round later is at the right.
        assert!(
            first[0] > 1.2 * first[1] && third[1] > 1.2 * third[0],
            "{placement}: {first:?} {third:?}"
        );
    }
}

#[test]
fn the_keys_of_many_lights_change_its_frames() {
    let still = ["--turn", "0", "--frames", "4"];
    let shown = |keys: &str| many_lights(&[&still[..], &["--keys", keys]].concat());
    let light = |picture: &image::RgbImage| mean(picture, [0.0, 1.0], [0.0, 1.0])[0];
    let (all, text) = shown("");
    for expected in [
        "64 lights",
        "visibility Rays",
        "bound Geometry",
        "filter on",
        "history off",
        "all light",
    ] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
    // Of the light of lamps alone there is less, and what is left of it is what virtual lights bring.
    let [(lamps, text), (indirect, more)] = [shown("p"), shown("pp")];
    assert!(text.contains("light of lamps") && more.contains("light of virtual lights"));
    assert!(
        light(&lamps) < light(&all) && light(&indirect) < light(&all),
        "{} {} {}",
        light(&lamps),
        light(&indirect),
        light(&all)
    );
    // Without visibility light goes through the boxes.
    let (through, _) = shown("vpp");
    assert!(
        light(&through) > 1.02 * light(&indirect),
        "{} {}",
        light(&through),
        light(&indirect)
    );
    for (keys, expected) in [
        ("vv", "visibility Imperfect"),
        ("vvv", "visibility Maps"),
        ("vvvv", "visibility Rays"),
    ] {
        let (_, text) = shown(keys);
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
    let (_, text) = shown("vppb+fh");
    for expected in [
        "128 lights",
        "visibility None",
        "bound Distance",
        "filter off",
        "history on",
        "light of virtual lights",
    ] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
    assert!(shown("-").1.contains("32 lights"));
}

#[test]
fn the_buffers_of_many_lights_are_shown_one_by_one() {
    let shown = |keys: &str, expected: &str| {
        let (picture, text) = many_lights(&["--turn", "0", "--frames", "4", "--keys", keys]);
        assert!(text.contains(&format!("{expected}: ")), "no {expected:?} in {text}");
        picture
    };
    let all = [0.0, 1.0];
    // The box has its x axis to the left, which is red; normals of the floor are green.
    let places = shown("g", "places");
    let [left, right] = [[0.0, 0.3], [0.7, 1.0]].map(|across| mean(&places, across, all)[0]);
    assert!(left > 1.5 * right, "{left} {right}");
    let normals = shown("gg", "normals");
    let [ceiling, floor] = [[0.04, 0.15], [0.85, 0.96]].map(|down| mean(&normals, [0.4, 0.6], down)[1]);
    assert!(floor > 2.0 * ceiling, "{ceiling} {floor}");
    let direct = shown("ggg", "direct light");
    let merged = shown("gggg", "indirect light before the filter");
    let filtered = shown("ggggg", "indirect light after the filter");
    let [direct, of_merged, of_filtered] = [&direct, &merged, &filtered].map(|picture| mean(picture, all, all)[0]);
    assert!(
        direct > 0.0 && (of_filtered / of_merged - 1.0).abs() < 0.3,
        "{of_merged} {of_filtered}"
    );
    assert!(merged != filtered, "nothing is filtered");
    shown("gggggg", "all light");
    // From a buffer to the next part of the light.
    shown("ggp", "light of lamps");
}

/// The last frame of the photon viewer, and what it said.
fn photon_viewer(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let small = ["--size", "80x60", "--photons", "4096"];
    let arguments = [&small[..], arguments].concat();
    let output = windowed(env!("CARGO_BIN_EXE_photon_viewer"), &arguments, &path);
    assert!(output.status.success(), "{}", said(&output));
    (open(&path), said(&output))
}

#[test]
fn the_photon_viewers_light_goes_around() {
    // The lamp stands to the right of the ring, and after half a round to its left. The wall near it is lit at a close distance.
    let sides = |frames: &str| {
        let (picture, text) = photon_viewer(&["--turn", "180", "--frames", frames]);
        assert_eq!(picture.dimensions(), (80, 60));
        let [left, right] = [[0.0, 0.3], [0.7, 1.0]].map(|across| mean(&picture, across, [0.0, 1.0])[1]);
        (left, right, text)
    };
    let (left, right, _) = sides("1");
    assert!(right > 1.2 * left && left > 5.0, "{left} {right}");
    let (other_left, other_right, text) = sides("4");
    assert!(other_left > 1.2 * other_right, "{other_left} {other_right}");
    // The scene is its own mirror image, but for the facets of the ring and the photons.
    assert!((other_left - right).abs() < 0.1 * right, "{other_left} {right}");
    for expected in ["medians of 3 frames", "frames/s", "photons/s", "trace", "map", "render"] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
}

#[test]
fn the_photon_viewer_converges_while_nothing_moves() {
    let still = |frames: &str| photon_viewer(&["--turn", "0", "--frames", frames]).0;
    let [first, fourth, last] = ["1", "4", "16"].map(still);
    let difference = |a: &image::RgbImage| {
        let pairs = a.as_raw().iter().zip(last.as_raw());
        pairs.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>()
    };
    assert!(
        difference(&fourth) < 0.5 * difference(&first),
        "{} {}",
        difference(&fourth),
        difference(&first)
    );
}

#[test]
fn the_photon_viewers_camera_flies() {
    let arguments = ["--turn", "0", "--flight", "0.1", "--frames"];
    let [before, after] = ["1", "4"].map(|frames| photon_viewer(&[&arguments[..], &[frames]].concat()).0);
    // By how many pixels the picture has gone to the left: the floor is seen from 2.3 m at 28 pixels per metre.
    let difference = |shift: u32| {
        let shared = (0..60).flat_map(|y| (20..60).map(move |x| (x, y)));
        let pairs = shared.map(|(x, y)| (before.get_pixel(x, y)[1], after.get_pixel(x - shift, y)[1]));
        pairs.map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>()
    };
    let found = (0..20).min_by_key(|shift| difference(*shift));
    assert!(found.is_some_and(|shift| (6..14).contains(&shift)), "{found:?}");
}

#[test]
fn the_photon_viewer_refuses_what_it_cannot_show() {
    for (arguments, expected) in [
        (&["--shape", "round"][..], "round"),
        (&["--photons", "many"], "many"),
        (&["--turn", "left"], "left"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_photon_viewer"))
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
    // A scene without a light that could move.
    let folder = tempfile::tempdir().unwrap();
    let output = windowed(
        env!("CARGO_BIN_EXE_photon_viewer"),
        &["builtin:cornell-box", "--frames", "1"],
        &folder.path().join("picture.png"),
    );
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("directional light"), "{}", said(&output));
}

/// A picture of photons in media without a window, and what was said.
fn volume_photons(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new folder/picture.png");
    let small = ["--size", "32x32", "--photons", "4096", "--frames", "4"];
    let output = ["--picture", path.to_str().unwrap()];
    let output = run(
        env!("CARGO_BIN_EXE_volume_photons"),
        &[&small[..], arguments, &output].concat(),
    );
    (open(&path), said(&output))
}

#[test]
fn photons_in_media_have_the_same_light_by_every_estimate() {
    let [march, ray, beams, planes, unified] = ["march", "ray", "beams", "planes", "unified"].map(|volume| {
        let (picture, text) = volume_photons(&["--volume", volume]);
        assert_eq!(picture.dimensions(), (32, 32));
        assert!(
            text.contains(&format!("{volume}, ")) && text.contains(" mm wide"),
            "{text}"
        );
        // Walls as in the Cornell box, behind fog that is lit by a white lamp.
        let [red, green] = [[0.04, 0.14], [0.86, 0.96]].map(|across| mean(&picture, across, [0.3, 0.7]));
        assert!(red[0] > 1.2 * red[1] && green[1] > 1.1 * green[0], "{red:?} {green:?}");
        mean(&picture, [0.0, 1.0], [0.0, 1.0])
    });
    // But for noise and blur, of which balls lose most by walls.
    for other in [march, beams, planes, unified] {
        for channel in 0..3 {
            let ratio = other[channel] / ray[channel];
            assert!(
                (ratio - 1.0).abs() < 0.1,
                "{march:?} {ray:?} {beams:?} {planes:?} {unified:?}"
            );
        }
    }
}

#[test]
fn the_same_frames_of_photons_in_media_are_the_same_picture() {
    let again = || volume_photons(&["--volume", "ray", "--turn", "20"]).0;
    assert!(again() == again());
}

#[test]
fn the_camera_among_photons_in_media_flies() {
    let [before, after] = ["0", "0.05"].map(|flight| volume_photons(&["--volume", "ray", "--flight", flight]).0);
    // In three frames it has come 15 cm nearer to the green wall, which ends at three quarters of the picture then: behind it the box is over, and there is nothing.
    let [lit, dark] = [&before, &after].map(|picture| mean(picture, [0.8, 1.0], [0.2, 0.8])[1]);
    assert!(lit > 5.0 && dark < 0.2 * lit, "{lit} {dark}");
    // The rest shows the box.
    let [was, is] = [&before, &after].map(|picture| mean(picture, [0.1, 0.6], [0.2, 0.8])[0]);
    assert!(is > 0.5 * was && was > 5.0, "{was} {is}");
}

/// The last frame of a window of photons in media, and what was said.
fn volume_photons_shown(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let small = ["--size", "40x40", "--photons", "2048"];
    let output = windowed(
        env!("CARGO_BIN_EXE_volume_photons"),
        &[&small[..], arguments].concat(),
        &path,
    );
    assert!(output.status.success(), "{}", said(&output));
    (open(&path), said(&output))
}

#[test]
fn the_lamp_in_the_fog_goes_around() {
    let [(first, _), (third, text)] = ["1", "3"].map(|frames| {
        let (picture, text) = volume_photons_shown(&["--turn", "90", "--frames", frames]);
        // The ceiling above the lamp, whose circle begins at the left of the picture.
        let sides = [[0.15, 0.45], [0.55, 0.85]].map(|across| mean(&picture, across, [0.04, 0.2])[1]);
        (sides, text)
    });
    assert!(
        first[0] > 1.1 * first[1] && third[1] > 1.1 * third[0],
        "{first:?} {third:?}"
    );
    for expected in ["ray, ", "kernels a ray", "medians of 2 frames", "photons/s"] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
}

#[test]
fn keys_change_the_estimate_of_photons_in_media() {
    for (volume, keys, expected) in [
        ("march", "ee", "unified, "),
        ("unified", "e", "beams, "),
        ("beams", "E", "planes, "),
    ] {
        let (_, text) = volume_photons_shown(&["--volume", volume, "--keys", keys, "--frames", "2"]);
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn photons_in_media_are_refused_what_they_cannot_show() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    for (arguments, expected) in [
        (&["--volume", "foggy"][..], "foggy"),
        (&["--photons", "many"], "many"),
        (&["--radius", "-1"], "volume_radius"),
        (&["--turn", "3", "builtin:fog-box"], "directional light"),
        (&["builtin:smoke", "--volume", "beams"], "homogeneous"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_volume_photons"))
            .args(arguments)
            .args(["--picture", path.to_str().unwrap(), "--size", "8x8"])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
}

/// A picture of the octahedron lab without a window, and what it said.
fn octahedron_lab(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new folder/picture.png");
    let small = [
        "--size",
        "360x150",
        "--texels",
        "64",
        "--output",
        path.to_str().unwrap(),
    ];
    let output = run(env!("CARGO_BIN_EXE_octahedron_lab"), &[&small[..], arguments].concat());
    (open(&path), said(&output))
}

/// Shares of the picture's width at which its three panels are.
const PANELS: [[f32; 2]; 3] = [[0.05, 0.3], [0.38, 0.62], [0.7, 0.95]];
/// Shares of its height at which maps of all layouts are.
const MIDDLE: [f32; 2] = [0.45, 0.6];

#[test]
fn the_octahedron_lab_shows_map_density_and_error() {
    for layout in ["square", "rectangle", "cube"] {
        for channel in ["colour", "distance", "object"] {
            let (picture, text) = octahedron_lab(&["--layout", layout, "--channel", channel]);
            assert_eq!(picture.dimensions(), (360, 150));
            let [map, density, error] = PANELS.map(|across| mean(&picture, across, MIDDLE));
            // The map shows something; against rays there is no error but at silhouettes, and black stands for none.
            assert!(map.iter().sum::<f32>() > 60.0, "{layout}, {channel}: {map:?}");
            assert!(
                error.iter().sum::<f32>() < 0.5 * map.iter().sum::<f32>(),
                "{layout}, {channel}: {error:?}"
            );
            assert!(density.iter().sum::<f32>() > 250.0, "{layout}, {channel}: {density:?}");
            assert!(
                text.contains(layout) && text.contains("another object than rays"),
                "{text}"
            );
            // Of some 4000 texels those next to edges may differ.
            let other: u32 = text
                .split(" with another object")
                .next()
                .and_then(|before| before.rsplit(' ').next()?.parse().ok())
                .unwrap();
            assert!(other < 40 && text.contains(" 0 of them empty"), "{text}");
        }
    }
}

#[test]
fn the_octahedron_labs_density_is_the_maps() {
    let (picture, _) = octahedron_lab(&[]);
    let at = |x: f32, y: f32| mean(&picture, [x, x + 0.012], [y, y + 0.03]);
    // In the middle of the square is a vertex of the octahedron, the finest place: blue. Half-way to a corner, the middle of a face: red.
    let (vertex, face) = (at(0.494, 0.485), at(0.435, 0.36));
    assert!(vertex[2] > vertex[0] + 60.0, "vertex {vertex:?}");
    assert!(face[0] > face[2] + 40.0, "face {face:?}");
}

#[test]
fn the_octahedron_labs_point_moves_and_a_cube_is_another_map() {
    let still = octahedron_lab(&["--turn", "0", "--frames", "3"]).0;
    assert!(still == octahedron_lab(&[]).0);
    assert!(still != octahedron_lab(&["--turn", "20", "--frames", "3"]).0);
    let (_, text) = octahedron_lab(&["--against", "cube"]);
    let other: u32 = text
        .split(" with another object")
        .next()
        .and_then(|before| before.rsplit(' ').next()?.parse().ok())
        .unwrap();
    assert!(text.contains("than the cube") && other > 5, "{text}");
}

#[test]
fn the_octahedron_lab_has_a_window_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let arguments = ["--size", "360x150", "--texels", "64", "--frames", "3"];
    let output = windowed(env!("CARGO_BIN_EXE_octahedron_lab"), &arguments, &path);
    assert!(output.status.success(), "{}", said(&output));
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (360, 150));
    // The third frame is that without a window.
    assert!(picture == octahedron_lab(&["--frames", "3"]).0);
    for (arguments, expected) in [
        (["--layout", "round"], "rectangle"),
        (["--channel", "smell"], "distance"),
        (["--texels", "4"], "8 to 2048"),
        (["builtin:nowhere", "--output"], "--output"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_octahedron_lab"))
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
}

/// A frame of the reflection preview without a window, and what it said.
fn reflection_preview(arguments: &[&str]) -> (image::RgbImage, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new folder/picture.png");
    let small = ["--size", "96x72", "--map", "64", "--shadow", "128", "--samples", "1"];
    let output = ["--output", path.to_str().unwrap()];
    let output = run(
        env!("CARGO_BIN_EXE_reflection_preview"),
        &[&small[..], arguments, &output].concat(),
    );
    (open(&path), said(&output))
}

/// Pixels that differ by more than so many steps in a channel.
fn differing(a: &image::RgbImage, b: &image::RgbImage, steps: u8) -> usize {
    let pairs = a.pixels().zip(b.pixels());
    let differs = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|c| a[c].abs_diff(b[c]) > steps);
    pairs.filter(differs).count()
}

#[test]
fn the_reflection_preview_shows_its_room_and_a_body_that_moves() {
    let (first, text) = reflection_preview(&["--shape", "sphere"]);
    assert_eq!(first.dimensions(), (96, 72));
    for expected in [
        "raster: surfaces",
        "shadow maps: distances",
        "preview: shade live map",
        "probe: filter",
    ] {
        assert!(text.contains(expected), "no {expected:?} in {text}");
    }
    // The wall to the left is terracotta, that to the right teal.
    let [left, right] = [[0.0, 0.12], [0.98, 1.0]].map(|across| mean(&first, across, [0.3, 0.5]));
    assert!(left[0] > 1.5 * left[2] && left[0] > 30.0, "left {left:?}");
    assert!(right[1] > 1.3 * right[0] && right[1] > 20.0, "right {right:?}");
    // The same frame again is the same picture; later the body is elsewhere, and the room away from it and its shadow stays.
    let (again, _) = reflection_preview(&["--shape", "sphere"]);
    assert!(first == again);
    let (later, _) = reflection_preview(&["--shape", "sphere", "--turn", "60", "--frames", "2"]);
    let moved = differing(&first, &later, 8);
    assert!((100..4000).contains(&moved), "{moved} pixels");
    assert!((mean(&later, [0.0, 0.12], [0.3, 0.5])[0] - left[0]).abs() < 3.0);
}

/// With a search in the map's distances the sphere shows its room otherwise, and all else is the same; without there is no such pass.
#[test]
fn the_reflection_preview_searches_where_it_is_told_to() {
    let [(plain, without), (searched, with)] =
        [&["--shape", "sphere"][..], &["--shape", "sphere", "--search", "3"]].map(reflection_preview);
    assert!(
        with.contains("preview: search") && !without.contains("preview: search"),
        "{with}"
    );
    let changed = differing(&plain, &searched, 8);
    assert!((20..3000).contains(&changed), "{changed} pixels");
    let wall = |picture: &image::RgbImage| mean(picture, [0.0, 0.12], [0.3, 0.5]);
    assert_eq!(wall(&plain), wall(&searched));
}

#[test]
fn the_reflection_previews_layouts_of_shadows_agree() {
    let of = |shadows: &str| reflection_preview(&["--shape", "sphere", "--shadows", shadows]).0;
    let [cube, octahedron, none] = ["cube", "octahedron", "none"].map(of);
    let borders = differing(&cube, &octahedron, 16);
    let shadows = differing(&octahedron, &none, 16);
    assert!(borders < 96 * 72 / 20, "{borders} pixels");
    assert!(shadows > 4 * borders && shadows > 200, "{shadows} pixels, {borders}");
}

#[test]
fn the_reflection_preview_has_a_window_and_takes_any_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    // Without lights of its own the scene gets one.
    let arguments = [
        "builtin:cornell-box",
        "--metal",
        "mirror",
        "--roughness",
        "0.4",
        "--map",
        "64",
    ];
    let arguments = [&arguments[..], &["--size", "64x64", "--frames", "3"]].concat();
    let output = windowed(env!("CARGO_BIN_EXE_reflection_preview"), &arguments, &path);
    assert!(output.status.success(), "{}", said(&output));
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (64, 64));
    assert_cornell_walls(&picture);
}

#[test]
fn the_reflection_preview_refuses_what_it_cannot_show() {
    for (arguments, expected) in [
        (&["--shape", "cone"][..], "cone"),
        (&["--metal", "tin"], "tin"),
        (&["--roughness", "2"], "from 0 to 1"),
        (&["--shadows", "paraboloid"], "paraboloid"),
        (&["--map", "100"], "--map: 100 is not a power of two"),
        (&["--search", "300"], "--search: 300 is not in 0..=256"),
        (&["--samples", "0"], "--samples: 0 is not from 1 to 8"),
        (&["--shadow", "0"], "--shadow: "),
        (&["--radius", "0"], "--radius: 0"),
        (&["--radius", "-1"], "--radius: -1"),
        (&["--radius", "NaN"], "--radius: NaN"),
        (&["builtin:point-in-fog"], "participating media"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let output = Command::new(env!("CARGO_BIN_EXE_reflection_preview"))
            .args(arguments)
            .args(["--size", "32x24", "--output", path.to_str().unwrap()])
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
}

/// The number behind the first ` by ` of the line that begins with these words.
fn printed(text: &str, name: &str) -> f32 {
    let line = text.lines().find(|line| line.starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no line of {name:?}: {text}"));
    let number = line.split(" by ").nth(1).and_then(|rest| rest.split(' ').next());
    number
        .and_then(|number| number.parse().ok())
        .unwrap_or_else(|| panic!("no number: {line}"))
}

/// The mirror room prints by how much each picture differs from that by rays.
#[test]
fn the_mirror_room_comes_nearer_to_rays_with_distances() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mirror.png");
    let small = ["--size", "32x32", "--spp", "16", "--map", "128"];
    let scene = ["--scene", "builtin:cornell-box?source=point&sphere=mirror"];
    let arguments = [&[path.to_str().unwrap()][..], &small, &scene].concat();
    let output = run(env!("CARGO_BIN_EXE_mirror_room"), &arguments);
    let text = said(&output);
    let [alone, step, search] = ["the map alone", "one step", "the search"].map(|name| printed(&text, name));
    assert!(step < 0.7 * alone && search < 0.7 * alone, "{text}");
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (128, 32));
}

/// The window goes through the methods by keys, and shows differences and residuals of each.
#[test]
fn the_mirror_room_has_a_window_and_keys() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mirror.png");
    let shown = |method: &str, keys: &str| {
        let scene = ["--scene", "builtin:cornell-box?source=point&sphere=mirror"];
        let small = [
            "--size", "40x40", "--frames", "6", "--map", "128", "--show", method, "--keys", keys,
        ];
        let output = windowed(env!("CARGO_BIN_EXE_mirror_room"), &[&scene[..], &small].concat(), &path);
        assert!(output.status.success(), "{}", said(&output));
        let whole = mean(&open(&path), [0.0, 1.0], [0.0, 1.0]).iter().sum::<f32>();
        (whole, said(&output), open(&path))
    };
    let (_, text, hybrid) = shown("hybrid", "p");
    assert!(text.contains("hybrid, "), "{text}");
    assert_cornell_walls(&hybrid);
    // From the last around to the first, and back again.
    for (method, keys, expected) in [("march", "M", "classical, "), ("classical", "nn", "hybrid, ")] {
        let (_, text, _) = shown(method, keys);
        assert!(text.contains(expected), "{expected}: {text}");
    }
    // The search differs less from rays than the map alone, and its residual is seen on the sphere alone.
    let [(alone, ..), (search, ..)] = ["classical", "hybrid"].map(|method| shown(method, "d"));
    assert!(alone > 1.2 * search && search > 0.0, "{alone} {search}");
    let (_, _, residual) = shown("hybrid", "e");
    assert_eq!(residual.get_pixel(1, 1).0, [0; 3]);
    let colored = residual.pixels().filter(|pixel| pixel.0 != [0; 3]).count();
    assert!((20..800).contains(&colored), "{colored}");
}

#[test]
fn the_mirror_room_names_the_methods_that_there_are() {
    let output = Command::new(env!("CARGO_BIN_EXE_mirror_room"))
        .args(["--show", "spiral"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    for word in ["--show: spiral", "classical", "one_step", "false_position", "march"] {
        assert!(said(&output).contains(word), "{word}: {}", said(&output));
    }
}

/// Schlick's curve without k loses the metals' colours, the compensated one is about as near as the exact factor, and three channels are not bins of wavelengths.
#[test]
fn metals_lose_their_colours_by_schlicks_curve() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metals.png");
    let small = ["--size", "48x48", "--spp", "4", "--bins", "8"];
    let arguments = [&[path.to_str().unwrap()][..], &small].concat();
    let output = run(env!("CARGO_BIN_EXE_metals"), &arguments);
    let text = said(&output);
    let [schlick, compensated, exact] = ["schlick", "compensated", "exact"].map(|name| printed(&text, name));
    assert!(schlick > 5.0 * exact && compensated < 1.5 * exact, "{text}");
    assert!(exact > 0.05 && exact < 3.0, "{text}");
    let picture = open(&path);
    assert_eq!(picture.dimensions(), (192, 48));
    // Copper is in the middle, and warm by the exact factor; most rings are dark at the left.
    let middle = |column: f32| mean(&picture, [(column + 0.4) / 4.0, (column + 0.6) / 4.0], [0.4, 0.6]);
    for color in [middle(2.0), middle(3.0)] {
        assert!(color[0] > 1.05 * color[2], "{color:?}");
    }
    let whole = |column: f32| {
        mean(&picture, [column / 4.0, (column + 1.0) / 4.0], [0.0, 1.0])
            .iter()
            .sum::<f32>()
    };
    let [left, exact] = [0.0, 2.0].map(whole);
    assert!(left < 0.97 * exact, "{left} {exact}");
}
