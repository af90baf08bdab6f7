//! Runs the program `clerestory` as a user or a script would, and looks at its files, its words and its exit codes.
//!
//! The commands that render need a Vulkan device and fail without one. Pictures are tiny and share their kernels.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use clerestory::film::{Picture, exr};
use serde_json::Value;

type Tested = Result<(), Box<dyn std::error::Error>>;

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_clerestory"))
}

fn run(arguments: &[&str]) -> Result<Output, std::io::Error> {
    program().args(arguments).stdin(Stdio::null()).output()
}

/// What the process said, for failures.
fn said(output: &Output) -> String {
    format!(
        "{}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

fn succeed(arguments: &[&str]) -> Result<Output, std::io::Error> {
    let output = run(arguments)?;
    assert!(output.status.success(), "{arguments:?}: {}", said(&output));
    Ok(output)
}

/// Runs and wants this exit code, `error:` first and every word somewhere in the error output, without a trace of a panic.
fn refuse(arguments: &[&str], code: i32, words: &[&str]) -> Tested {
    let output = run(arguments)?;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", said(&output));
    assert!(stderr.starts_with("error:"), "{arguments:?}: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{arguments:?}: {word:?} is not in {stderr}");
    }
    assert!(
        !stderr.contains("panicked") && !stderr.contains("fault in the program"),
        "{stderr}"
    );
    Ok(())
}

fn json(bytes: &[u8]) -> Result<Value, serde_json::Error> {
    serde_json::from_slice(bytes)
}

fn json_file(path: &Path) -> Result<Value, Box<dyn std::error::Error>> {
    Ok(json(&std::fs::read(path)?)?)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap_or_default()
}

fn gray(path: &Path, size: u32, value: f32) -> Tested {
    let picture = Picture::from_radiance(size, size, vec![value; (size * size * 3) as usize])?;
    Ok(exr::write(path, &picture)?)
}

#[test]
fn info_says_which_files_a_scene_has_read() -> Tested {
    let folder = tempfile::tempdir()?;
    let model = folder.path().join("m.obj");
    std::fs::write(&model, "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")?;
    std::fs::write(folder.path().join("m.mtl"), "newmtl a\n")?;
    let model = model.display().to_string();
    let info = json(&succeed(&["info", &model, "--files", "--json"])?.stdout)?;
    let files = info["files"].as_array().into_iter().flatten();
    let names: Vec<&str> = files.filter_map(|file| file["path"].as_str()).collect();
    assert!(
        names.len() == 2 && names[0].ends_with("m.obj") && names[1].ends_with("m.mtl"),
        "{info}"
    );
    assert_eq!(info["files"][1]["bytes"], 9);
    assert!(
        json(&succeed(&["info", &model, "--json"])?.stdout)?
            .get("files")
            .is_none()
    );
    let text = succeed(&["info", "builtin:cornell-box", "--files"])?.stdout;
    assert!(String::from_utf8_lossy(&text).contains("file          none"));
    Ok(())
}

#[test]
fn a_rendering_leaves_picture_preview_and_report() -> Tested {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("new/a.exr");
    let output = succeed(&[
        "render",
        "--size",
        "32x24",
        "--spp",
        "2",
        "--aov",
        "normal,depth,samples",
        "--stats",
        "table",
        "-o",
        text(&path),
    ])?;
    let picture = exr::read(&path)?;
    let layers: Vec<&str> = picture.layers().iter().map(|layer| layer.name()).collect();
    assert_eq!((picture.width(), picture.height()), (32, 24));
    assert_eq!(layers.len(), 4, "{layers:?}");
    for name in ["radiance", "normal", "depth", "samples"] {
        assert!(layers.contains(&name), "{layers:?}");
    }
    assert!(picture.main_layer()?.values().iter().any(|value| *value > 0.0));
    let shown = image::open(path.with_extension("png"))?;
    assert_eq!((shown.width(), shown.height()), (32, 24));
    let report = json_file(&path.with_extension("json"))?;
    assert_eq!(report["samples"], serde_json::json!([2, 2]));
    assert_eq!(report["interrupted"], Value::Bool(false));
    assert!(report["counters"]["paths"].as_u64() == Some(2 * 32 * 24));
    let table = String::from_utf8(output.stdout.clone())?;
    for word in [
        "path: extend",
        "rays",
        "total",
        "depth",
        "left out",
        "builtin:cornell-box",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    for stream in [&output.stdout, &output.stderr] {
        let control = String::from_utf8_lossy(stream)
            .chars()
            .find(|c| c.is_control() && *c != '\n');
        assert_eq!(control, None, "{}", said(&output));
    }
    assert_eq!(std::fs::read_dir(folder.path().join("new"))?.count(), 3);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("made folder"),
        "{}",
        said(&output)
    );
    Ok(())
}

#[test]
fn a_rendering_is_summed_up_in_lines_that_matter() -> Tested {
    let folder = tempfile::tempdir()?;
    let (reference, picture) = (folder.path().join("r.exr"), folder.path().join("a.exr"));
    let lines = |more: &[&str]| -> Result<Vec<String>, Box<dyn std::error::Error>> {
        let small = ["render", "--size", "16", "--spp", "2"];
        let said = String::from_utf8(succeed(&[&small[..], more].concat())?.stdout)?;
        Ok(said.lines().map(str::to_owned).collect())
    };
    let said = |lines: &[String], name: &str| {
        let found = lines.iter().find(|line| line.starts_with(name));
        found.cloned().unwrap_or_else(|| panic!("{name}: {lines:?}"))
    };
    let first = lines(&["-o", text(&reference)])?;
    assert!((8..13).contains(&first.len()), "{first:?}");
    assert!(first[0].starts_with("picture") && first[0].contains("r.exr") && first[0].contains("r.json"));
    for (name, word) in [
        ("technique", "path, the default; unbiased"),
        ("seconds", "after the first step"),
        ("samples", "2 per pixel"),
        ("rates", "rays/s"),
        ("memory", "on the device"),
        ("error", "unknown"),
        ("more", "--stats table"),
    ] {
        assert!(said(&first, name).contains(word), "{name}: {first:?}");
    }
    let again = ["--seed", "1", "--technique", "path", "-o", text(&picture)];
    let second = lines(&[&again[..], &["--reference", text(&reference)]].concat())?;
    assert!(said(&second, "technique").contains("as asked for"), "{second:?}");
    assert!(
        said(&second, "error").contains("root of the relative MSE"),
        "{second:?}"
    );
    Ok(())
}

#[test]
fn kd_trees_are_kept_and_read_again() -> Tested {
    let folder = tempfile::tempdir()?;
    let cache = folder.path().join("new/indexes");
    let picture = folder.path().join("a.exr");
    let render = |index: &'static str| {
        let size = [
            "render",
            "builtin:cornell-box",
            "--size",
            "8",
            "--spp",
            "1",
            "-o",
            text(&picture),
        ];
        run(&[&size[..], &["--index", index, "--index-cache", text(&cache)]].concat())
    };
    let mut pixels = Vec::new();
    for (kept, words) in [("written", "kept for the next time"), ("read", "read, not built")] {
        let output = render("kd")?;
        assert!(output.status.success(), "{}", said(&output));
        assert!(
            String::from_utf8_lossy(&output.stdout).contains(words),
            "{}",
            said(&output)
        );
        assert_eq!(json_file(&picture.with_extension("json"))?["index"]["kept"], kept);
        pixels.push(exr::read(&picture)?.main_layer()?.values().to_vec());
    }
    assert_eq!(pixels[0], pixels[1]);
    assert_eq!(std::fs::read_dir(&cache)?.count(), 1);
    let refused = render("bvh2")?;
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));

    let scene = ["--scene", "builtin:cornell-box", "--repeat", "1", "--rays", "10"];
    let index = [&["index", "--index-cache", text(&cache)][..], &scene].concat();
    let table = String::from_utf8(succeed(&index)?.stdout)?;
    assert!(table.contains("kd: read in"), "the same tree as the picture's: {table}");
    let soup = ["--scene", "builtin:triangle-soup?n=50", "--repeat", "1", "--rays", "10"];
    let index = [&["index", "--json", "--index-cache", text(&cache)][..], &soup].concat();
    for was_read in [false, true] {
        let report = json(&succeed(&index)?.stdout)?;
        assert_eq!(report["kept"][0]["was_read"], was_read, "{report}");
    }
    Ok(())
}

/// A kept tree that is broken, or in whose place something else stands, costs a build and a warning: neither the run nor the picture.
#[test]
fn kept_kd_trees_that_are_broken_are_built_anew_and_said_once() -> Tested {
    let folder = tempfile::tempdir()?;
    let cache = folder.path().join("indexes");
    let picture = folder.path().join("a.exr");
    let render = || {
        let size = ["render", "builtin:cornell-box", "--size", "8", "--spp", "1"];
        let index = ["--index", "kd", "--index-cache", text(&cache), "-o", text(&picture)];
        succeed(&[&size[..], &index].concat())
    };
    render()?;
    let pixels = exr::read(&picture)?.main_layer()?.values().to_vec();
    let kept = std::fs::read_dir(&cache)?.next().ok_or("no file")??.path();
    let whole = std::fs::read(&kept)?;
    for broken in [&b""[..], b"not a tree", &whole[..whole.len() / 2]] {
        std::fs::write(&kept, broken)?;
        let output = render()?;
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(stderr.matches("made anew").count(), 1, "{}", said(&output));
        assert_eq!(json_file(&picture.with_extension("json"))?["index"]["kept"], "written");
        assert_eq!(exr::read(&picture)?.main_layer()?.values(), pixels);
        assert_eq!(std::fs::read(&kept)?, whole);
    }
    // Every repeat meets what cannot be replaced; it is said once.
    std::fs::remove_file(&kept)?;
    std::fs::create_dir(&kept)?;
    let index = [
        "index",
        "--scene",
        "builtin:cornell-box",
        "--repeat",
        "3",
        "--rays",
        "10",
    ];
    let output = succeed(&[&index[..], &["--index-cache", text(&cache)]].concat())?;
    assert_eq!(said(&output).matches("made anew").count(), 1, "{}", said(&output));
    assert!(said(&output).contains("not kept"), "{}", said(&output));
    for command in ["render", "index"] {
        let help = String::from_utf8(succeed(&[command, "--help"])?.stdout)?;
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains("trusted with how long rays take"), "{help}");
    }
    Ok(())
}

/// A command that opens a device, but neither compiles nor dispatches anything.
fn opens_a_device() -> Command {
    let mut command = program();
    command.args([
        "index",
        "--scene",
        "builtin:triangle-soup?n=1",
        "--repeat",
        "1",
        "--rays",
        "2",
    ]);
    command.env_remove("LOCALAPPDATA").stdin(Stdio::null());
    command
}

#[test]
fn pipelines_are_kept_in_absolute_folders_only() -> Tested {
    for (caches, home) in [("", ""), ("caches", "home"), ("./", "..")] {
        let folder = tempfile::tempdir()?;
        let below = folder.path().join("current");
        std::fs::create_dir(&below)?;
        let mut command = opens_a_device();
        command
            .current_dir(&below)
            .env("XDG_CACHE_HOME", caches)
            .env("HOME", home);
        let output = command.output()?;
        assert!(output.status.success(), "{}", said(&output));
        for place in [
            "clerestory",
            ".cache/clerestory",
            "caches/clerestory",
            "home/.cache/clerestory",
            "../.cache/clerestory",
        ] {
            assert!(!below.join(place).exists(), "{caches:?} and {home:?} lead to {place}");
        }
    }
    Ok(())
}

#[test]
fn a_pipeline_cache_that_is_broken_is_made_anew_and_said_once() -> Tested {
    let folder = tempfile::tempdir()?;
    let cache = folder.path().join("clerestory");
    let open = || -> Result<(String, std::path::PathBuf), Box<dyn std::error::Error>> {
        let output = opens_a_device().env("XDG_CACHE_HOME", folder.path()).output()?;
        assert!(output.status.success(), "{}", said(&output));
        let files: Vec<_> = std::fs::read_dir(&cache)?.collect::<Result<_, _>>()?;
        assert_eq!(files.len(), 1, "{files:?}");
        Ok((String::from_utf8_lossy(&output.stderr).into_owned(), files[0].path()))
    };
    let (stderr, file) = open()?;
    assert!(!stderr.contains("made anew"), "{stderr}");
    let whole = std::fs::read(&file)?;
    for broken in [&whole[..whole.len() / 2], &whole[36..], b"", b"no cache"] {
        std::fs::write(&file, broken)?;
        let (stderr, file) = open()?;
        assert_eq!(stderr.matches("made anew").count(), 1, "{stderr}");
        assert!(std::fs::read(&file)?.starts_with(b"CLPIPELN"), "{file:?}");
        let (stderr, _) = open()?;
        assert!(!stderr.contains("made anew"), "{stderr}");
    }
    let help = String::from_utf8(succeed(&["--help"])?.stdout)?;
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("trusted as the driver is"), "{help}");
    Ok(())
}

#[test]
fn indexes_are_compared_also_where_the_device_cannot_build_one() -> Tested {
    let scenes = ["builtin:triangle-soup?n=1", "builtin:triangle-soup?n=500"];
    let scenes = ["--scene", scenes[0], "--scene", scenes[1]];
    let output = succeed(&[&["index", "--json", "--repeat", "2", "--rays", "100"][..], &scenes].concat())?;
    let report = json(&output.stdout)?;
    let rows = report["indexes"].as_array().map_or(0, Vec::len);
    // Eight of the host for each scene, and one of the device.
    assert_eq!(rows, 17, "{}", said(&output));
    let skipped = report["skipped"].as_array().cloned().unwrap_or_default();
    assert_eq!(skipped.len(), 1);
    assert_eq!(skipped[0]["index"], "lbvh, fast, device");
    assert!(
        skipped[0]["because"]
            .as_str()
            .is_some_and(|why| why.contains("two triangles"))
    );
    Ok(())
}

#[test]
fn frame_methods_are_rendered_as_other_techniques() -> Tested {
    let folder = tempfile::tempdir()?;
    let picture = folder.path().join("p.exr");
    let scene = "builtin:cornell-box?source=point";
    let small = [
        "render",
        scene,
        "--technique",
        "preview",
        "--size",
        "16x16",
        "--spp",
        "3",
        "--stats",
        "json",
    ];
    let output = succeed(&[&small[..], &["--path-set", "bounces=0..1", "-o", text(&picture)]].concat())?;
    let report = json(&output.stdout)?;
    assert_eq!(
        (&report["technique"], &report["path_set"]),
        (&"preview".into(), &"bounces=0..1".into())
    );
    assert_eq!(report["counters"]["frames"], 3);
    assert_eq!(report["settings"]["shadow_layout"], "octahedron");
    assert!(picture.exists());
    let refused = |more: &[&str], code, words: &[&str]| refuse(&[&small[..], more].concat(), code, words);
    refused(&["--path-set", "direct"], 2, &["preview has no --path-set"])?;
    refused(&["--settings", "{\"shadow_side\": 0}"], 2, &["shadow"])?;
    Ok(())
}

/// Mean radiance of a picture, channel by channel.
fn mean_radiance(path: &Path) -> Result<[f64; 3], Box<dyn std::error::Error>> {
    let picture = exr::read(path)?;
    let values = picture.main_layer()?.values().to_vec();
    let pixels = (values.len() / 3) as f64;
    let sum = |c: usize| values.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>();
    Ok([0, 1, 2].map(|c| sum(c) / pixels))
}

#[test]
fn photons_through_fog_and_glass_hold_all_light() -> Tested {
    let folder = tempfile::tempdir()?;
    let scene = "builtin:fog-box?sphere=glass";
    let of = |technique: &str, spp: &str, settings: &str| -> Result<(Value, [f64; 3]), Box<dyn std::error::Error>> {
        let picture = folder.path().join(format!("{technique}.exr"));
        let asked = [
            "render",
            scene,
            "--technique",
            technique,
            "--spp",
            spp,
            "--settings",
            settings,
        ];
        let small = ["--size", "16x16", "--stats", "json", "-o", text(&picture)];
        let output = succeed(&[&asked[..], &small[..]].concat())?;
        Ok((json(&output.stdout)?, mean_radiance(&picture)?))
    };
    let (report, photons) = of("photon", "16", "{\"photons\": 16384}")?;
    assert_eq!(
        (&report["technique"], &report["path_set"]),
        (&"photon".into(), &"all".into())
    );
    let count = |name: &str| report["counters"][name].as_u64().unwrap_or_default();
    assert_eq!(count("photons_emitted"), 16 << 14);
    assert_eq!(
        count("photons_escaped") + count("photons_absorbed"),
        count("photons_emitted")
    );
    for name in [
        "photons_stored",
        "events_stored",
        "events_gathered",
        "medium_collisions",
    ] {
        assert!(count(name) > 1000, "{name}: {report}");
    }
    let (_, paths) = of("path", "1024", "{}")?;
    for (found, expected) in photons.iter().zip(paths) {
        // Noise of some hundred thousand paths, of which few go through the sphere, and light that kernels lose by walls.
        assert!((found / expected - 1.0).abs() < 0.05, "{photons:?}, not {paths:?}");
    }
    Ok(())
}

#[test]
fn settings_reach_the_technique_and_the_reference_is_measured() -> Tested {
    let folder = tempfile::tempdir()?;
    let (reference, settings) = (folder.path().join("r.exr"), folder.path().join("settings.json"));
    std::fs::write(&settings, "{\"roulette_start\": 7}")?;
    let with = |more: &[&'static str], files: &[&str]| -> Result<Output, std::io::Error> {
        let direct = ["render", "--path-set", "direct", "--spp", "2", "--stats", "json"];
        succeed(&[&direct[..], more, files].concat())
    };
    let from_file = format!("@{}", text(&settings));
    let output = with(
        &["--size", "32x32"],
        &["-o", text(&reference), "--settings", &from_file],
    )?;
    let report = json(&output.stdout)?;
    assert_eq!(report["index"]["kind"], "wide");
    assert_eq!(report["path_set"], "direct");
    assert_eq!(report["settings"]["roulette_start"], 7);

    // The same picture again, at the reference's size, as a PNG alone.
    let png = folder.path().join("only.png");
    let output = with(
        &["--tone", "neutral", "--index", "lbvh-device"],
        &["-o", text(&png), "--reference", text(&reference)],
    )?;
    let report = json(&output.stdout)?;
    // Another index, and no other picture.
    assert_eq!(report["index"]["kind"], "lbvh-device");
    assert!(
        report["index"]["stages"]["hierarchy"]
            .as_f64()
            .is_some_and(|ms| ms > 0.0)
    );
    for key in ["nodes", "leaves", "max_depth", "sah_cost", "build_ms"] {
        assert!(report["index"][key].as_f64().is_some_and(|value| value > 0.0), "{key}");
    }
    assert_eq!(report["size"], serde_json::json!([32, 32]));
    assert_eq!(report["error"]["mse"], 0.0);
    assert!(png.exists() && png.with_extension("json").exists() && !png.with_extension("exr").exists());

    // A picture never takes the place of what it is compared with; outputs.rs has all other commands.
    let [r, o] = [text(&reference); 2];
    refuse(
        &["render", "--reference", r, "-o", o],
        2,
        &["this command reads it", "another output"],
    )?;

    // Independent samples are other samples, and other light paths are pointed out.
    let output = succeed(&[
        "render",
        "--spp",
        "2",
        "--stats",
        "none",
        "--sampler",
        "pcg",
        "--reference",
        text(&reference),
        "-o",
        text(&png),
    ])?;
    assert!(output.stdout.is_empty());
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("light paths"),
        "{}",
        said(&output)
    );
    let report = json_file(&png.with_extension("json"))?;
    assert!(report["error"]["mse"].as_f64().is_some_and(|mse| mse > 0.0));
    Ok(())
}

#[test]
fn a_time_budget_stops_early_and_says_so() -> Tested {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.exr");
    let output = succeed(&[
        "render",
        "--size",
        "32x32",
        "--spp",
        "100000000",
        "--time-budget",
        "1ms",
        "-o",
        text(&path),
    ])?;
    let report = json_file(&path.with_extension("json"))?;
    assert_eq!(report["stopped_early"], Value::Bool(true));
    // A busy machine ends no sample in that time.
    let most = report["samples"][1].as_u64().unwrap_or(u64::MAX);
    assert!(most < 100_000_000, "{most}");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("time is up"),
        "{}",
        said(&output)
    );
    assert_eq!(exr::read(&path)?.pixel_count(), 1024);
    Ok(())
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_complete_files() -> Tested {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.exr");
    let mut child = program()
        .args([
            "-v",
            "render",
            "--size",
            "32x32",
            "--spp",
            "100000000",
            "-o",
            text(&path),
        ])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    // The program says at `-v` when it has begun to listen.
    let mut stderr = std::io::BufReader::new(child.stderr.take().ok_or("no error output")?);
    let mut heard = String::new();
    while !heard.contains("rendering") {
        if std::io::BufRead::read_line(&mut stderr, &mut heard)? == 0 {
            return Err(format!("ended too early: {heard}").into());
        }
    }
    let killed = Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()?;
    assert!(killed.success());
    std::io::Read::read_to_string(&mut stderr, &mut heard)?;
    let status = child.wait()?;
    assert_eq!(status.code(), Some(130), "{heard}");
    assert!(
        heard.contains("interrupted") && heard.contains("samples per pixel"),
        "{heard}"
    );
    let report = json_file(&path.with_extension("json"))?;
    assert_eq!(report["interrupted"], Value::Bool(true));
    // Black, where the request came before the first wave had ended.
    let picture = exr::read(&path)?;
    let most = report["samples"][1].as_u64().ok_or("no count of samples")?;
    assert_eq!(
        picture.main_layer()?.values().iter().any(|value| *value > 0.0),
        most > 0
    );
    assert_eq!(picture.pixel_count(), 1024);
    assert_eq!(image::open(path.with_extension("png"))?.width(), 32);
    Ok(())
}

#[test]
fn mistakes_have_their_exit_codes_and_words() -> Tested {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("a.exr");
    let out = text(&out);
    let render = |more: &[&'static str], code, words: &[&str]| {
        let arguments: Vec<&str> = ["render", "--size", "8", "--spp", "1", "-o", out]
            .iter()
            .chain(more)
            .copied()
            .collect();
        refuse(&arguments, code, words)
    };
    render(&["builtin:nothing"], 3, &["nothing", "cornell-box"])?;
    render(&["builtin:cornell-box?lihgt=1"], 3, &["lihgt", "allowed: light"])?;
    render(&["builtin:cornel-box"], 3, &["did you mean builtin:cornell-box?"])?;
    render(&["builtin:"], 3, &["builtin:: without a name", "ring"])?;
    render(&["cornell-box"], 3, &["did you mean builtin:cornell-box?"])?;
    render(&["no-such-file.glb"], 3, &["no-such-file.glb", "hint:"])?;
    render(
        &["--camera", "nobody"],
        2,
        &["no camera is called nobody", "hint: there is: main"],
    )?;
    render(
        &["--technique", "magic"],
        2,
        &["no technique is called magic", "hint: there is: path"],
    )?;
    render(&["--device", "abacus"], 5, &["abacus", "there is"])?;
    render(&["--device", "99"], 5, &["99"])?;
    render(&["--path-set", "dirct"], 2, &["dirct", "indirect"])?;
    render(&["--settings", "{\"roulete\": 1}"], 2, &["roulete", "roulette_start"])?;
    render(&["--settings", "{\"seed\": 1}"], 2, &["seed", "hint: use --seed"])?;
    render(
        &["--settings", "{\"path_set\": \"foo\"}"],
        2,
        &["setting path_set: \"foo\" is not known"],
    )?;
    render(&["--settings", "@no-such-file"], 2, &["no-such-file"])?;
    render(&["--settings", "3"], 2, &["JSON object", "hint: "])?;
    render(
        &["--settings", "{\"roulette_start\": -4}"],
        2,
        &["roulette_start", "-4"],
    )?;
    render(
        &["--settings", "{\"roulette_start\": \"x\"}"],
        2,
        &["roulette_start", "type"],
    )?;
    render(&["--path-set", "bounces=3..1"], 2, &["is empty"])?;
    render(&["--reference", "no-such.exr"], 1, &["no-such.exr"])?;
    refuse(&["render", "--size", "0x4"], 2, &["WIDTHxHEIGHT"])?;
    refuse(&["render", "--spp", "0"], 2, &["--spp"])?;
    refuse(
        &["render", "--index", "octree"],
        2,
        &[
            "octree",
            "there is: bvh2, lbvh, lbvh-high, lbvh-device, kd, wide, wide-device, two-level, driver, auto",
        ],
    )?;
    refuse(&["render", "-o", "a.jpg"], 2, &[".exr or .png"])?;
    refuse(&["scenes", "nothing"], 2, &["ring"])?;
    refuse(&["info", "builtin:nothing"], 3, &["cornell-box"])?;
    refuse(&["info", "--device", "abacus"], 5, &["abacus", "there is"])?;
    refuse(&["info", "builtin:ring", "--device", "0"], 2, &["--device"])?;
    refuse(
        &["compare", "a.exr", "b.exr", "--validation", "core"],
        2,
        &["--validation"],
    )?;
    refuse(&["agreement", "--device", "abacus", "--python", "true"], 5, &["abacus"])?;
    refuse(&["report", "--device", "abacus"], 5, &["abacus"])?;
    refuse(&["report", "--repeat", "0"], 2, &["--repeat"])?;
    refuse(&["render", "--size", "65535x65535"], 2, &["memory", "--size"])?;
    refuse(&["list", "xylophone"], 2, &["xylophone"])?;
    refuse(&["list", "lbhv"], 2, &["nearest: CL-LBVH"])?;
    refuse(
        &["agreement", "--scene", "nothing", "--python", "true"],
        2,
        &["nothing"],
    )?;
    refuse(&["rendre"], 2, &["render"])?;
    Ok(())
}

#[test]
fn comparisons_judge_by_thresholds_and_refuse_what_cannot_be_compared() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    let (a, b, small, broken) = (at("a.exr"), at("b.exr"), at("small.exr"), at("broken.exr"));
    gray(&a, 16, 0.5)?;
    gray(&b, 16, 0.75)?;
    gray(&small, 8, 0.5)?;
    let bytes = std::fs::read(&a)?;
    std::fs::write(&broken, &bytes[..bytes.len() / 2])?;
    let [a, b, small, broken] = [&a, &b, &small, &broken].map(|path| text(path));

    let output = succeed(&["compare", a, a, "--threshold", "rmse=0,flip=0"])?;
    assert!(String::from_utf8_lossy(&output.stdout).contains("RMSE"));
    refuse(&["compare", a, b, "--threshold", "rmse=0.1"], 4, &["rmse", "2.500e-1"])?;
    succeed(&["compare", a, b, "--threshold", "rmse=0.26"])?;
    let difference = at("difference.png");
    let output = succeed(&["compare", a, b, "--json", "--diff", text(&difference)])?;
    assert_eq!(json(&output.stdout)?["metrics"]["bias"], -0.25);
    // Too dark everywhere, by the whole scale.
    assert_eq!(image::open(&difference)?.into_rgb8().get_pixel(3, 3).0, [0, 0, 255]);

    refuse(&["compare", a, small], 2, &["16×16", "8×8"])?;
    let sizes = ["render", "--size", "16", "--spp", "1", "--reference", small];
    refuse(&sizes, 2, &["16 × 16", "8 × 8"])?;
    refuse(&["compare", a, "no-such.exr"], 1, &["no-such.exr"])?;
    refuse(&["compare", a, broken], 1, &["broken.exr"])?;
    refuse(&["compare", a, "picture.gif"], 1, &["gif"])?;
    refuse(&["compare", a, "picture"], 1, &["has no ending", ".exr"])?;
    refuse(&["compare", a, b, "--threshold", "ssim=1"], 2, &["flip"])?;

    // sRGB code 188 is linear 0.5029; the nearest code to 0.5 errs by less than half a code's width, 0.5 · 0.0061.
    let png = at("a.png");
    image::RgbImage::from_pixel(16, 16, image::Rgb([188; 3])).save(&png)?;
    succeed(&["compare", text(&png), a, "--threshold", "max_error=0.0031"])?;
    Ok(())
}

#[test]
fn lists_are_readable_by_people_and_programs() -> Tested {
    let scenes = json(&succeed(&["scenes", "--json"])?.stdout)?;
    let names: Vec<_> = scenes
        .as_array()
        .ok_or("no list")?
        .iter()
        .map(|scene| &scene["name"])
        .collect();
    assert!(names.iter().any(|name| *name == "cornell-box"), "{names:?}");
    let list = json(&succeed(&["list", "--json"])?.stdout)?;
    assert_eq!(list["techniques"][0]["id"], "path");
    let settings = String::from_utf8(succeed(&["list", "path"])?.stdout)?;
    assert!(
        settings.contains("roulette_start") && settings.contains("bounces"),
        "{settings}"
    );
    assert!(list["techniques"][0]["default_settings"]["roulette_start"].is_u64());
    assert!(
        list["catalogue"]
            .as_array()
            .is_some_and(|rows| rows.iter().any(|row| row["id"] == "BG-3"))
    );
    let row = String::from_utf8(succeed(&["list", "bg-3"])?.stdout)?;
    for said in [
        "engine/src/techniques/path/mod.rs",
        "role         technique",
        "limits       Slow where",
        "J. Kajiya: The Rendering Equation, SIGGRAPH, 1986",
    ] {
        assert!(row.contains(said), "{said}: {row}");
    }
    let found = String::from_utf8(succeed(&["list", "photon", "mapping"])?.stdout)?;
    assert!(found.starts_with("photon (PM-SYS-1)\n"), "{found}");
    let help = String::from_utf8(succeed(&["list", "--help"])?.stdout)?;
    assert!(
        help.contains("OEM-") && help.contains("octahedron environment maps"),
        "{help}"
    );
    // Where everything of a technique is stands in the list itself.
    let all = String::from_utf8(succeed(&["list"])?.stdout)?;
    for said in [
        "  code         engine/src/techniques/photon_mapping/\n",
        "  kernels      shaders/techniques/photon_mapping/\n",
        "tests/tests/photon/convergence.rs\n",
        "  measured by  clerestory report photon-convergence",
        "  results      results/photon-",
        "  settings     `path_set`, `photons`",
        "  call         clerestory::techniques::photon_mapping::PhotonMapper\n",
    ] {
        assert!(all.contains(said), "{said}: {all}");
    }
    assert_eq!(list["techniques"][0]["row"]["role"]["kind"], "technique");
    assert_eq!(list["techniques"][0]["row"]["sources"][0]["key"], "kajiya-1986");
    assert_eq!(
        list["techniques"][0]["results"][0]["path"],
        "results/error-against-time/README.md"
    );
    let sources = String::from_utf8(succeed(&["list", "--sources"])?.stdout)?;
    assert!(sources.contains("| kajiya-1986 | J. Kajiya"), "{sources}");
    let devices = json(&succeed(&["info", "--json", "--validation", "off", "--device", "0"])?.stdout)?;
    assert!(devices["devices"][0]["caps"]["subgroup_size"].is_u64());
    assert!(devices["devices"][0]["techniques"][0]["fault"].is_null());
    let scene = json(&succeed(&["info", "builtin:ring", "--json"])?.stdout)?;
    assert_eq!(scene["cameras"][0]["name"], "main");
    assert_eq!(scene["techniques"][0]["refusals"], serde_json::json!([]));
    for command in [
        &["scenes"][..],
        &["list"],
        &["info"],
        &["info", "builtin:ring"],
        &["--help"],
    ] {
        let stdout = String::from_utf8(succeed(command)?.stdout)?;
        assert!(
            stdout.lines().count() > 3 && !stdout.contains('\x1b'),
            "{command:?}: {stdout}"
        );
    }
    Ok(())
}

#[test]
fn a_reader_that_goes_is_no_error() -> Tested {
    let mut child = program()
        .arg("scenes")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    drop(child.stdout.take());
    let output = child.wait_with_output()?;
    assert!(output.status.success() && output.stderr.is_empty(), "{}", said(&output));
    Ok(())
}

#[test]
fn a_benchmark_counts_its_runs() -> Tested {
    let arguments = [
        "bench",
        "--scene",
        "builtin:cornell-box",
        "--size",
        "32",
        "--spp",
        "2",
        "--repeat",
        "3",
        "--json",
    ];
    let report = json(&succeed(&arguments)?.stdout)?;
    let scene = &report["scenes"][0];
    assert_eq!(scene["repeat"], 3);
    let rates = &scene["rays_per_second"];
    let of = |name: &str| rates[name].as_f64().unwrap_or(0.0);
    assert!(
        of("least") > 0.0 && of("least") <= of("median") && of("median") <= of("greatest"),
        "{rates}"
    );
    Ok(())
}

#[test]
fn a_report_has_a_table_for_its_scene() -> Tested {
    let folder = tempfile::tempdir()?;
    let (references, out) = (folder.path().join("references"), folder.path().join("out"));
    let arguments = [
        "report",
        "--smoke",
        "--scene",
        "builtin:cornell-box",
        "--repeat",
        "1",
        "--references",
        text(&references),
        "--folder",
        text(&out),
    ];
    succeed(&arguments)?;
    let written = std::fs::read_to_string(out.join("error-against-time-smoke/report.md"))?;
    assert!(
        written.contains("## `builtin:cornell-box` (38 triangles)") && written.contains("Smoke run"),
        "{written}"
    );
    // Two variants, budgets of 2, 8 and 32 samples.
    let rows = |budget: &str| {
        written
            .lines()
            .filter(|line| line.contains(&format!("| {budget} spp |")))
            .count()
    };
    assert_eq!(["2", "8", "32"].map(rows), [2; 3], "{written}");
    assert_eq!(std::fs::read_dir(&references)?.count(), 1);
    assert!(out.join("error-against-time-smoke/index.html").is_file());
    Ok(())
}

#[test]
fn hard_cases_are_listed_judged_and_shown() -> Tested {
    let list = String::from_utf8(succeed(&["stability", "--list"])?.stdout)?;
    for word in [
        "scales",
        "breaks",
        "expects",
        "path (sobol), path (pcg), path (joint-sobol), photon, ",
        ", bvh2, lbvh, lbvh-high, kd, wide",
        "degrades",
    ] {
        assert!(list.contains(word), "{word}: {list}");
    }
    let judged = json(&succeed(&["stability", "empty-scene", "--json"])?.stdout)?;
    let outcomes = judged["outcomes"].as_array().ok_or("no outcomes")?;
    let subjects = judged["subjects"].as_array().ok_or("no subjects")?;
    // All but the scattering functions, which no scene concerns, and estimates of media, of which there are none.
    let of_media = |name: &serde_json::Value| name.as_str().is_some_and(|name| name.starts_with("photon ("));
    let without = subjects.iter().filter(|name| of_media(name)).count() + 1;
    assert_eq!(outcomes.len() + without, subjects.len(), "{judged}");
    for outcome in outcomes {
        // Techniques of a part of the light refuse what has another; whatever holds all light passes.
        let subject = outcome["subject"].as_str().ok_or("no subject")?;
        let holds_all = ["path", "photon", "bvh2", "lbvh", "kd", "wide"]
            .iter()
            .any(|name| subject.starts_with(name));
        if holds_all || outcome["verdict"] == "pass" {
            assert_eq!(outcome["verdict"], "pass", "{outcome}");
            assert!(outcome["figures"].as_array().is_some_and(|figures| !figures.is_empty()));
        } else {
            assert_eq!(outcome["verdict"], "refused", "{outcome}");
            assert!(
                outcome["reason"].as_str().is_some_and(|reason| !reason.is_empty()),
                "{outcome}"
            );
        }
    }
    let table = String::from_utf8(succeed(&["stability", "empty-scene", "--technique", "path"])?.stdout)?;
    assert!(table.contains("path (pcg)") && !table.contains("bvh2"), "{table}");
    let page = String::from_utf8(succeed(&["stability", "empty-scene", "--markdown"])?.stdout)?;
    assert!(
        page.starts_with("# Stability") && page.contains("### empty-scene"),
        "{page}"
    );
    let folder = tempfile::tempdir()?;
    let pictures = folder.path().join("pictures");
    succeed(&["stability", "empty-scene", "--pictures", text(&pictures)])?;
    let picture = image::open(pictures.join("empty-scene.png"))?;
    assert_eq!((picture.width(), picture.height()), (64, 64));
    refuse(&["stability", "nothing"], 2, &["nothing", "--list"])?;
    refuse(&["stability", "--technique", "nothing"], 2, &["nothing"])
}
