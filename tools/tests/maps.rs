//! Runs `clerestory maps` as a user would: which way up files are, what is kept, what is refused.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use clerestory::film::{Picture, exr, hdr};
use clerestory::maps::{MapImage, Parametrization};
use clerestory::transport::environment::{environment_direction, environment_uv};
use glam::{DVec2, DVec3, UVec2, Vec3};
use serde_json::Value;

type Tested = Result<(), Box<dyn std::error::Error>>;

fn maps(arguments: &[&str]) -> Result<Output, std::io::Error> {
    let mut program = Command::new(env!("CARGO_BIN_EXE_clerestory"));
    program.arg("maps").args(arguments).stdin(Stdio::null()).output()
}

fn succeed(arguments: &[&str]) -> Result<Output, std::io::Error> {
    let output = maps(arguments)?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    Ok(output)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap_or_default()
}

/// A smooth sky whose every axis looks different.
fn sky(d: DVec3) -> Vec3 {
    (DVec3::new(1.5 + d.x, 1.5 + d.y, 1.5 + d.z) + 0.4 * d.x * d.z).as_vec3()
}

const SIZE: UVec2 = UVec2::new(128, 64);
/// Of an interpolant over a kink: a quarter of a texel times the slope.
const FOLD_ERROR: f32 = 0.25 * 0.13 * 1.4;

/// The sky as the engine's environments hold it.
fn write_sky(path: &Path) -> Tested {
    let mut values = Vec::new();
    for y in 0..SIZE.y {
        for x in 0..SIZE.x {
            let uv = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / SIZE.as_dvec2();
            values.extend(sky(environment_direction(uv)).to_array());
        }
    }
    Ok(exr::write(path, &Picture::from_radiance(SIZE.x, SIZE.y, values)?)?)
}

fn read(path: &Path) -> Result<(UVec2, Vec<Vec3>), Box<dyn std::error::Error>> {
    let picture = exr::read(path)?;
    let texels = picture.main_layer()?.pixels().map(Vec3::from_array).collect();
    Ok((UVec2::new(picture.width(), picture.height()), texels))
}

/// Each map holds the light of the world's directions, and leads back to the file that a scene reads.
#[test]
fn directions_are_those_of_environments() -> Tested {
    let folder = tempfile::tempdir()?;
    let (file, there, back) = ["sky.exr", "there.exr", "back.exr"]
        .map(|name| folder.path().join(name))
        .into();
    write_sky(&file)?;
    for name in [
        "octahedron",
        "octahedron-rectangular",
        "cube",
        "paraboloid",
        "equal-area",
        "octahedron-c=2",
    ] {
        let map: Parametrization = name.parse()?;
        let size = ["--size", "48", "--filter", "bilinear"];
        succeed(&[&[text(&file), text(&there), "--to", name][..], &size].concat())?;
        let (extent, texels) = read(&there)?;
        let image = MapImage::from_strip(map, extent, 0, &texels)?;
        for i in 0..200u32 {
            // A spiral over the sphere.
            let z = 1.0 - (f64::from(i) + 0.5) / 100.0;
            let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let d = DVec3::new(r * cos, z, r * sin);
            let found = image.look_up(map.world_axes() * d).unwrap_or_default();
            // Texels of at most 0.13 rad under a slope of at most 1.4, interpolated over the folds of the map, where it has kinks.
            assert!(
                (found.as_vec3() - sky(d)).abs().max_element() < FOLD_ERROR,
                "{name} {d}: {found} {}",
                sky(d)
            );
        }
        let to = [
            "--from", name, "--to", "lat-long", "--size", "64", "--filter", "bilinear",
        ];
        succeed(&[&[text(&there), text(&back)][..], &to].concat())?;
        let (extent, texels) = read(&back)?;
        assert_eq!(extent, SIZE);
        for (i, value) in texels.iter().enumerate() {
            let uv = (DVec2::new((i % 128) as f64, (i / 128) as f64) + 0.5) / SIZE.as_dvec2();
            let d = environment_direction(uv);
            assert!(
                (*value - sky(d)).abs().max_element() < 1.5 * FOLD_ERROR,
                "{name} {d}: {value} {}",
                sky(d)
            );
            assert!((environment_uv(d) - uv).length() < 1e-12);
        }
    }
    Ok(())
}

/// A scene lit by the file and by what came back through an octahedron: mirrors and matte spheres look alike.
#[test]
fn scenes_look_the_same_after_a_round_trip() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    write_sky(&at("sky.exr"))?;
    succeed(&[
        text(&at("sky.exr")),
        text(&at("map.exr")),
        "--to",
        "octahedron",
        "--size",
        "96",
    ])?;
    let back = ["--from", "octahedron", "--to", "lat-long", "--size", "64"];
    succeed(&[&[text(&at("map.exr")), text(&at("back.exr"))][..], &back].concat())?;
    let mut pictures = Vec::new();
    for name in ["sky", "back"] {
        let scene = at(&format!("{name}.toml"));
        let lines = format!("file = \"builtin:materials\"\n[environment]\nfile = \"{name}.exr\"\n");
        std::fs::write(&scene, lines)?;
        let picture = at(&format!("{name}-picture.exr"));
        let output = Command::new(env!("CARGO_BIN_EXE_clerestory"))
            .args([
                "render",
                text(&scene),
                "--size",
                "32x24",
                "--spp",
                "16",
                "-o",
                text(&picture),
            ])
            .output()?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        pictures.push(read(&picture)?.1);
    }
    let mean = |texels: &[Vec3]| texels.iter().map(|value| value.as_dvec3()).sum::<DVec3>() / texels.len() as f64;
    let squares: f64 = pictures[0]
        .iter()
        .zip(&pictures[1])
        .map(|(a, b)| (*a - *b).as_dvec3().length_squared())
        .sum();
    let rms = (squares / (3.0 * pictures[0].len() as f64)).sqrt();
    let level = mean(&pictures[0]).element_sum() / 3.0;
    // The same numbers meet texels of 3° through a map of like texels: one of them at a slope of 1, and some samples that choose another
    // texel. A sky that is turned or mirrored is off by its own deviation, 0.58.
    assert!(level > 0.1 && rms < 0.05 * level, "{rms} of {level}");
    Ok(())
}

#[test]
fn the_integral_is_said_and_kept() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    write_sky(&at("sky.exr"))?;
    for (to, border) in [("cube", "1"), ("octahedron", "2"), ("paraboloid", "0"), ("sphere", "0")] {
        let (file, out) = (at("sky.exr"), at("new/out.exr"));
        let output = succeed(&[text(&file), text(&out), "--to", to, "--border", border, "--json"])?;
        let said: Value = serde_json::from_slice(&output.stdout)?;
        for channel in 0..3 {
            let off = said["relative_difference"][channel].as_f64().unwrap_or(f64::NAN);
            assert!(off.abs() < 1e-3, "{to}: {said}");
            let before = said["before"]["integral"][channel].as_f64().unwrap_or(f64::NAN);
            // ∫ of a constant 1.5; the other terms are odd. Texels are samples at their middles, in rows of 2.8°.
            assert!((before / (6.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{said}");
        }
        let table = succeed(&[
            text(&out),
            text(&at("back.hdr")),
            "--from",
            to,
            "--from-border",
            border,
            "--to",
            "lat-long",
        ])?;
        let table = String::from_utf8(table.stdout)?;
        for word in ["before", "after", "relative difference", to] {
            assert!(table.contains(word), "{word}: {table}");
        }
    }
    Ok(())
}

/// EXR and Radiance HDR, in and out, through three maps: the same light, but for the shared exponent of HDR files.
#[test]
fn every_format_leads_to_every_other() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: String| folder.path().join(name);
    write_sky(&at("sky.exr".into()))?;
    let (width, height, values) = {
        let picture = exr::read(at("sky.exr".into()))?;
        let values: Vec<f32> = picture.main_layer()?.pixels().flatten().collect();
        (picture.width(), picture.height(), values)
    };
    hdr::write(at("sky.hdr".into()), &Picture::from_radiance(width, height, values)?)?;
    for to in ["cube", "octahedron", "paraboloid"] {
        let map: Parametrization = to.parse()?;
        let mut images = Vec::new();
        for from in ["exr", "hdr"] {
            for out in ["exr", "hdr", "EXR"] {
                let (file, written) = (at(format!("sky.{from}")), at(format!("{to}-{from}.{out}")));
                let output = succeed(&[text(&file), text(&written), "--to", to, "--size", "24", "--json"])?;
                let said: Value = serde_json::from_slice(&output.stdout)?;
                assert_eq!(said["after"]["map"], to);
                let picture = if out == "hdr" {
                    hdr::read(&written)?
                } else {
                    exr::read(&written)?
                };
                let extent = UVec2::new(picture.width(), picture.height());
                let texels: Vec<Vec3> = picture.main_layer()?.pixels().map(Vec3::from_array).collect();
                images.push((from, out, MapImage::from_strip(map, extent, 0, &texels)?));
            }
        }
        let (_, _, first) = &images[0];
        for (from, out, image) in &images {
            let exact = *from == "exr" && *out != "hdr";
            assert!(!exact || image == first, "{to}, {from} to {out}");
            for (found, expected) in image.texels().iter().zip(first.texels()) {
                // Eight bits of the greatest component, once for a file that is read and once for one that is written.
                let allowed = if exact {
                    0.0
                } else {
                    2.0 / 256.0 * 2.0 * expected.max_element()
                };
                let off = (*found - *expected).abs().max_element();
                assert!(off <= allowed, "{to}, {from} to {out}: {found} {expected}");
            }
        }
    }
    Ok(())
}

/// In a pipe there is no bar and no line but the table.
#[test]
fn a_pipe_holds_nothing_but_the_table() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    write_sky(&at("sky.exr"))?;
    let output = succeed(&[
        text(&at("sky.exr")),
        text(&at("out.exr")),
        "--to",
        "cube",
        "--samples",
        "32",
    ])?;
    assert_eq!(String::from_utf8(output.stderr)?, "");
    let said = String::from_utf8(output.stdout)?;
    assert!(
        said.lines().count() == 4 && !said.contains('\u{1b}') && !said.contains('%'),
        "{said}"
    );
    Ok(())
}

/// Ctrl-C in the midst of a long conversion: it ends soon with the code for that, an older output stays, and nothing lies beside it.
#[test]
fn a_conversion_that_is_stopped_leaves_the_old_file() -> Tested {
    let folder = tempfile::tempdir()?;
    let (file, out) = (folder.path().join("sky.exr"), folder.path().join("out.exr"));
    write_sky(&file)?;
    succeed(&[text(&file), text(&out), "--to", "octahedron", "--size", "8"])?;
    let before = std::fs::read(&out)?;
    let mut program = Command::new(env!("CARGO_BIN_EXE_clerestory"));
    program.args(["-v", "maps", text(&file), text(&out), "--to", "octahedron"]);
    let mut child = program
        .args(["--size", "4096", "--samples", "64"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    // The program says at `-v` when it has begun to listen.
    let mut stderr = std::io::BufReader::new(child.stderr.take().ok_or("no error output")?);
    let mut heard = String::new();
    while !heard.contains("converting") {
        if std::io::BufRead::read_line(&mut stderr, &mut heard)? == 0 {
            return Err(format!("ended too early: {heard}").into());
        }
    }
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status()?.success());
    std::io::Read::read_to_string(&mut stderr, &mut heard)?;
    assert_eq!(child.wait()?.code(), Some(130), "{heard}");
    assert!(heard.contains("stopped") && heard.contains("not written"), "{heard}");
    assert_eq!(std::fs::read(&out)?, before);
    assert_eq!(std::fs::read_dir(folder.path())?.count(), 2);
    Ok(())
}

#[test]
fn what_cannot_be_is_refused() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    write_sky(&at("sky.exr"))?;
    let broken = Picture::from_radiance(2, 1, vec![1.0, 1.0, f32::NAN, 0.0, 0.0, 0.0])?;
    exr::write(at("broken.exr"), &broken)?;
    let (sky, out, broken) = (at("sky.exr"), at("out.exr"), at("broken.exr"));
    for (arguments, code, word) in [
        (
            vec![text(&sky), text(&out), "--to", "octa"],
            2,
            "octahedron-rectangular",
        ),
        (
            vec![text(&sky), text(&out), "--to", "cube", "--size", "0"],
            2,
            "1..=16384",
        ),
        (
            vec![text(&sky), text(&out), "--to", "cube", "--samples", "65"],
            2,
            "1..=64",
        ),
        (
            vec![text(&sky), text(&out), "--from", "octahedron", "--to", "cube"],
            2,
            "square",
        ),
        (
            vec![text(&sky), text(&out), "--from", "cube", "--to", "lat-long"],
            2,
            "side by side",
        ),
        (
            vec![text(&sky), text(&out), "--to", "sphere", "--border", "1"],
            2,
            "disc",
        ),
        (
            vec![text(&sky), text(&out), "--to", "cube", "--size", "4", "--border", "5"],
            2,
            "wider",
        ),
        // Hours of conversion, were they not refused before it.
        (
            [
                &[text(&sky), text(&out), "--to", "octahedron", "--size", "4096"][..],
                &["--samples", "64", "--border", "4097"],
            ]
            .concat(),
            2,
            "wider",
        ),
        (
            [
                &[text(&sky), text(&out), "--to", "nusselt", "--size", "4096"][..],
                &["--samples", "64", "--border", "1"],
            ]
            .concat(),
            2,
            "disc",
        ),
        (
            vec![text(&sky), text(&out), "--to", "cube", "--size", "8192"],
            2,
            "--size 8192",
        ),
        (
            vec![
                text(&sky),
                text(&out),
                "--to",
                "octahedron",
                "--size",
                "8192",
                "--border",
                "8192",
            ],
            2,
            "--size 8192",
        ),
        (vec![text(&sky), "out.png", "--to", "cube"], 2, ".exr or .hdr"),
        (vec!["missing.exr", text(&out), "--to", "cube"], 1, "missing.exr"),
        (vec![text(&broken), text(&out), "--to", "octahedron"], 1, "NaN"),
    ] {
        let output = maps(&arguments)?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(
            said.starts_with("error:") && said.contains(word),
            "{arguments:?}: {said}"
        );
    }
    assert!(!out.exists());
    Ok(())
}
