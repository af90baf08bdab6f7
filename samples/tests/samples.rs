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

/// The picture's size and the number of different colours in it.
fn look(path: &Path) -> ([u32; 2], usize) {
    let picture = image::open(path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .into_rgba8();
    let colours: std::collections::BTreeSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
    (picture.dimensions().into(), colours.len())
}

/// Runs a sample that writes one picture and takes its path as argument.
fn picture_of(program: &str) -> image::RgbaImage {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new folder/picture.png");
    let output = Command::new(program)
        .arg(&path)
        .env("CLERESTORY_VALIDATION", "core")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    image::open(&path).unwrap().into_rgba8()
}

#[test]
fn hello_triangle_offscreen_draws_its_corners() {
    let picture = picture_of(env!("CARGO_BIN_EXE_hello_triangle_offscreen"));
    assert_eq!(picture.dimensions(), (512, 512));
    let dominant = |x, y| {
        let pixel = picture.get_pixel(x, y).0;
        (0..3).max_by_key(|channel| pixel[*channel]).unwrap()
    };
    // Near the corners red (top), green (right) and blue (left); outside of the triangle the background.
    assert_eq!([dominant(256, 80), dominant(430, 395), dominant(80, 395)], [0, 1, 2]);
    assert_eq!(picture.get_pixel(10, 10), picture.get_pixel(500, 500));
    assert_ne!(picture.get_pixel(10, 10), picture.get_pixel(256, 256));
}

#[test]
fn embedding_samples_render_the_same_picture() {
    let headless = picture_of(env!("CARGO_BIN_EXE_embed_headless"));
    let host = picture_of(env!("CARGO_BIN_EXE_embed_host_device"));
    assert_eq!(headless.dimensions(), (640, 360));
    assert_eq!(host.dimensions(), (640, 360));
    // The sky is smooth: one frame and sixteen agree there to a step of rounding.
    for x in 0..640 {
        let (a, b) = (headless.get_pixel(x, 0).0, host.get_pixel(x, 0).0);
        assert!((0..4).all(|c| a[c].abs_diff(b[c]) <= 1), "{x}: {a:?} {b:?}");
    }
}

#[test]
fn a_sample_that_cannot_write_says_so() {
    let output = Command::new(env!("CARGO_BIN_EXE_embed_headless"))
        .arg("/dev/null/picture.png")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("/dev/null"), "{error}");
    assert!(!error.contains("panicked"), "{error}");
}

/// The viewer on a virtual X server.
fn viewer(arguments: &[&str], screenshot: &Path) -> Output {
    Command::new("xvfb-run")
        .args(["-a", env!("CARGO_BIN_EXE_viewer")])
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
fn the_viewer_shows_frames_and_resizes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("first.png");
    let output = viewer(&["--frames", "6"], &path);
    assert!(output.status.success(), "{}", said(&output));
    let (size, colours) = look(&path);
    assert_eq!(size, [640, 480]);
    assert!(colours > 100, "only {colours} colours");

    let path = folder.path().join("second.png");
    let output = viewer(&["--frames", "60", "--resize", "500x300"], &path);
    assert!(output.status.success(), "{}", said(&output));
    let (size, colours) = look(&path);
    assert_eq!(size, [500, 300]);
    assert!(colours > 100, "only {colours} colours");
}

#[test]
fn the_viewer_refuses_what_it_does_not_know() {
    for arguments in [["--frames", "many"], ["--resize", "wide"], ["--colour", "red"]] {
        let output = Command::new(env!("CARGO_BIN_EXE_viewer"))
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(error.contains(arguments[0]) && error.contains(arguments[1]), "{error}");
    }
}
