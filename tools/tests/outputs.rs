//! Runs the commands of the program on outputs that they must not write, and in situations in which they cannot.
//!
//! Pictures are tiny. What needs a Vulkan device fails without one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use clerestory::film::{Picture, exr, mark, png};
use serde_json::Value;

type Tested = Result<(), Box<dyn std::error::Error>>;

fn program(folder: &Path) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_clerestory"));
    program.current_dir(folder).stdin(Stdio::null());
    program
}

fn said(output: &Output) -> String {
    format!("{}\n{}", output.status, String::from_utf8_lossy(&output.stderr))
}

/// Runs in the folder and wants this exit code and these words.
fn wants(folder: &Path, line: &str, code: i32, words: &[&str]) -> Tested {
    let output = program(folder).args(line.split_whitespace()).output()?;
    assert_eq!(output.status.code(), Some(code), "{line}: {}", said(&output));
    for word in words {
        assert!(
            said(&output).contains(word),
            "{line}: {word:?} is not in {}",
            said(&output)
        );
    }
    Ok(())
}

/// A picture whose pixels all differ, so that it takes some bytes.
fn noise(size: u32, seed: u32) -> Result<Picture, clerestory::Error> {
    let values =
        (0..size * size * 3).map(|i| (i.wrapping_add(seed).wrapping_mul(747_796_405) >> 8) as f32 / (1 << 24) as f32);
    Picture::from_radiance(size, size, values.collect())
}

/// The contents of all files below a folder.
fn contents(folder: &Path) -> Result<BTreeMap<PathBuf, Vec<u8>>, std::io::Error> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(contents(&path)?);
        } else {
            found.insert(path.clone(), std::fs::read(&path)?);
        }
    }
    Ok(found)
}

fn count(folder: &Path) -> Result<usize, std::io::Error> {
    Ok(std::fs::read_dir(folder)?.count())
}

/// Everything that commands read, under names that they would write by.
fn fill(folder: &Path) -> Tested {
    let at = |name: &str| folder.join(name);
    exr::write(at("a.exr"), &noise(8, 1)?)?;
    exr::write(at("b.exr"), &noise(8, 2)?)?;
    exr::write(at("sky.exr"), &Picture::from_radiance(8, 4, vec![0.5; 96])?)?;
    let shown = png::tone_mapped(noise(4, 3)?.main_layer()?, 4, &clerestory::film::ToneMap::default());
    // A texture and a picture that bear the engine's own mark.
    png::write(at("duck.png"), &shown)?;
    png::write(at("c.png"), &shown)?;
    std::fs::write(at("soup.obj"), "v -1 0 0\nv 1 0 0\nv 0 1.5 0\nf 1 2 3\n")?;
    std::fs::write(
        at("lit.toml"),
        "file = \"soup.obj\"\n[environment]\nfile = \"sky.exr\"\n",
    )?;
    std::fs::write(at("settings.json"), "{\"roulette_start\": 7}")?;
    std::fs::write(at("package.json"), "{\"name\": \"package\", \"version\": \"1.0.0\"}")?;
    std::fs::write(at("duck.gltf"), duck())?;
    std::fs::create_dir_all(at("tables/tiny"))?;
    std::fs::create_dir_all(at("pages/samplers"))?;
    std::fs::write(at("pages/samplers/report.md"), "# Somebody's report\n")?;
    std::fs::write(at("tables/index.csv"), "somebody's,table\n")?;
    std::fs::write(at("tables/sort.json"), "[1, 2]")?;
    std::fs::write(at("tables/notes.md"), "# Notes\n")?;
    std::fs::write(at("tables/empty-scene.png"), "no picture")?;
    std::fs::write(at("tables/tiny/tiny.toml"), EXPERIMENT)?;
    Ok(())
}

const EXPERIMENT: &str = "title = \"tiny\"\nabout = \"What a test looks at.\"\nsystems = [\"BG-2\"]\n[sweep]\n\
    scenes = [\"builtin:cornell-box\"]\nsize = [16, 16]\nspp = [1, 4]\nrepeats = 2\n[sweep.reference]\nspp = 64\n\
    [[sweep.variant]]\nname = \"independent\"\nsettings = { sampler = \"pcg\" }\n";

/// A triangle with the texture duck.png.
fn duck() -> String {
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let texels = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let floats = positions.iter().flatten().chain(texels.iter().flatten());
    // Percent-encoded bytes need no other encoder.
    let bytes: String = floats
        .flat_map(|value| value.to_le_bytes())
        .map(|byte| format!("%{byte:02x}"))
        .collect();
    serde_json::json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "duck.png" }],
        "buffers": [{ "uri": format!("data:application/octet-stream,{bytes}"), "byteLength": 60 }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 24 },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0] },
            { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" },
        ],
    })
    .to_string()
}

/// Each command that writes, with each of its own inputs as output, or with a file there that is not the program's.
const REFUSED: [(&str, &str); 24] = [
    ("render --spp 1 --reference a.exr -o a.exr", "reads it"),
    ("render --spp 1 --reference a.exr -o a.exr --overwrite", "reads it"),
    ("render --size 4 --spp 1 --reference c.png -o c.exr", "reads it"),
    ("render lit.toml --size 4 --spp 1 -o sky.exr", "reads it"),
    ("render lit.toml --size 4 --spp 1 -o sky.exr --overwrite", "reads it"),
    ("render duck.gltf --size 4 --spp 1 -o duck.exr", "reads it"),
    ("render duck.gltf --size 4 --spp 1 -o duck.exr --overwrite", "reads it"),
    ("render soup.obj --size 4 --spp 1 -o soup.obj", ".exr or .png"),
    (
        "render --size 4 --spp 1 --settings @settings.json -o settings.exr --overwrite",
        "reads it",
    ),
    ("render --size 4 --spp 1 -o package.exr", "did not write it"),
    ("render --size 4 --spp 1 -o package.png", "did not write it"),
    ("compare a.exr b.exr --diff a.exr", "written as .png"),
    ("compare a.exr b.exr --diff b.jpg", "written as .png"),
    ("compare c.png c.png --diff c.png", "reads it"),
    ("compare c.png c.png --diff ./tables/../c.png --overwrite", "reads it"),
    ("maps sky.exr sky.exr --to octahedron", "reads it"),
    ("maps sky.exr sky.exr --to octahedron --overwrite", "reads it"),
    ("index --peers --scene soup.obj --folder tables", "did not write it"),
    ("index --peers --scene soup.obj --page soup.obj", "reads it"),
    ("bench --sort --folder tables", "did not write it"),
    ("bench --sort --page package.json", "pages are .md files"),
    ("report tables/tiny/tiny.toml --folder tables", "lies in the folder"),
    ("report samplers --folder pages", "did not write it"),
    ("stability empty-scene --pictures tables", "did not write it"),
];

#[test]
fn no_command_writes_over_what_it_reads_or_what_is_not_its_own() -> Tested {
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    let before = contents(folder.path())?;
    for (line, word) in REFUSED {
        wants(folder.path(), line, 2, &["error:", word])?;
        assert!(contents(folder.path())? == before, "{line} changed a file");
    }
    let python = "agreement --python tables/notes.md --output tables";
    wants(folder.path(), python, 2, &["lies in the folder"])?;
    let results = "agreement --python true --results package";
    wants(folder.path(), results, 2, &["did not write it"])?;
    assert!(contents(folder.path())? == before);
    // Each command of the help that can write stands above: all that take --overwrite.
    let help = program(folder.path()).arg("--help").output()?;
    let help = String::from_utf8(help.stdout)?;
    // Continued lines are indented further.
    let named = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let commands = help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let commands = commands
        .take_while(|line| !line.is_empty())
        .filter(named)
        .filter_map(|line| line.split_whitespace().next());
    let mut seen = 0;
    for command in commands.filter(|command| *command != "help") {
        let options = program(folder.path()).args([command, "--help"]).output()?;
        let writes = String::from_utf8(options.stdout)?.contains("--overwrite");
        let tried = command == "agreement" || REFUSED.iter().any(|(line, _)| line.split(' ').next() == Some(command));
        assert_eq!(writes, tried, "{command}");
        seen += 1;
    }
    assert!(seen >= 11, "{seen} commands: {help}");
    Ok(())
}

#[test]
fn overwrite_replaces_what_is_not_the_programs() -> Tested {
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("d.png"), "no picture")?;
    wants(
        folder.path(),
        "compare a.exr b.exr --diff d.png",
        2,
        &["did not write it", "--overwrite"],
    )?;
    wants(folder.path(), "compare a.exr b.exr --diff d.png --overwrite", 0, &[])?;
    assert!(mark::is_marked(&at("d.png"))?);
    // Its own file is replaced unasked.
    wants(folder.path(), "compare b.exr a.exr --diff d.png", 0, &[])?;
    wants(
        folder.path(),
        "maps sky.exr new/o.exr --to octahedron",
        0,
        &["made folder"],
    )?;
    wants(folder.path(), "maps sky.exr new/o.exr --to octahedron --size 8", 0, &[])?;
    wants(folder.path(), "maps sky.exr new/o.hdr --to octahedron --size 8", 0, &[])?;
    wants(folder.path(), "maps sky.exr new/o.hdr --to octahedron --size 8", 0, &[])?;
    assert_eq!(count(&at("new"))?, 2);
    Ok(())
}

/// Where a file of an output's set cannot be written, nothing is rendered.
#[test]
fn places_that_cannot_be_written_are_found_before_the_work() -> Tested {
    let folder = tempfile::tempdir()?;
    std::fs::create_dir(folder.path().join("d.json"))?;
    std::fs::write(folder.path().join("file"), "no folder")?;
    // More samples than anybody has time for.
    let render = "render --size 8 --spp 100000000 -o ";
    wants(folder.path(), &format!("{render}d.exr"), 2, &["d.json", "is a folder"])?;
    wants(folder.path(), &format!("{render}file/d.exr"), 1, &["file/d.exr"])?;
    wants(
        folder.path(),
        &format!("{render}file/new/d.exr"),
        1,
        &["file/new/d.exr"],
    )?;
    assert_eq!(count(folder.path())?, 2);
    Ok(())
}

/// A process that may write no file of that size is ended by the system unless it looks first; then it leaves what it began.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_on_the_size_of_files_loses_nothing() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    exr::write(at("a.exr"), &noise(64, 1)?)?;
    exr::write(at("b.exr"), &noise(64, 2)?)?;
    let line = |limit: &str| {
        let mut shell = Command::new("sh");
        let program = env!("CARGO_BIN_EXE_clerestory");
        shell.args([
            "-c",
            &format!("{limit} exec {program} compare a.exr b.exr --diff d.png"),
        ]);
        shell
            .current_dir(folder.path())
            .env("TMPDIR", folder.path())
            .stdin(Stdio::null())
            .output()
    };
    let free = line("")?;
    assert!(free.status.success(), "{}", said(&free));
    let before = contents(folder.path())?;
    assert!(
        before[&at("d.png")].len() > 4096,
        "{} bytes",
        before[&at("d.png")].len()
    );
    // One block, of 512 or 1024 bytes.
    let limited = line("ulimit -f 1;")?;
    assert_eq!(limited.status.code(), Some(1), "{}", said(&limited));
    assert!(
        said(&limited).contains("ulimit -f") && said(&limited).contains("nor could it"),
        "{}",
        said(&limited)
    );
    assert!(
        contents(folder.path())? == before,
        "{:?}",
        contents(folder.path())?.keys()
    );
    Ok(())
}

#[cfg(unix)]
#[test]
fn modes_and_links_of_outputs_stay() -> Tested {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("disk"))?;
    symlink("disk/real.png", at("d.png"))?;
    let line = "compare a.exr b.exr --diff d.png";
    wants(folder.path(), line, 0, &[])?;
    std::fs::set_permissions(at("disk/real.png"), std::fs::Permissions::from_mode(0o600))?;
    wants(folder.path(), "compare b.exr a.exr --diff d.png", 0, &[])?;
    assert!(at("d.png").symlink_metadata()?.is_symlink());
    assert_eq!(at("disk/real.png").metadata()?.permissions().mode() & 0o777, 0o600);
    // A device is nothing that can be replaced.
    symlink("/dev/null", at("device.png"))?;
    wants(
        folder.path(),
        "compare a.exr b.exr --diff device.png",
        2,
        &["not a regular file"],
    )?;
    assert!(at("device.png").symlink_metadata()?.is_symlink());
    Ok(())
}

#[test]
fn of_processes_with_one_output_none_loses_its_picture() -> Tested {
    let folder = tempfile::tempdir()?;
    exr::write(
        folder.path().join("sky.exr"),
        &Picture::from_radiance(64, 32, vec![0.5; 64 * 32 * 3])?,
    )?;
    let start = |rows: usize| {
        let rows = rows.to_string();
        let arguments = [
            "maps",
            "sky.exr",
            "o.exr",
            "--to",
            "octahedron",
            "--samples",
            "1",
            "--json",
            "--size",
            &rows,
        ];
        program(folder.path())
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
    };
    let running = [16, 18, 20, 22].map(start);
    let mut places = std::collections::BTreeSet::new();
    for (child, rows) in running.into_iter().zip([16, 18, 20, 22]) {
        let output = child?.wait_with_output()?;
        assert!(output.status.success(), "{}", said(&output));
        let report: Value = serde_json::from_slice(&output.stdout)?;
        let place = report["after"]["file"].as_str().ok_or("no file")?.to_owned();
        places.insert(place.clone());
        // A process that began after another had ended replaces that one's picture, which is what it was asked for.
        let picture = exr::read(folder.path().join(&place))?;
        assert!(
            picture.height() == rows || place == "o.exr",
            "{place}: {}",
            picture.height()
        );
    }
    assert!(places.contains("o.exr"), "{places:?}");
    assert_eq!(count(folder.path())?, 1 + places.len());
    Ok(())
}

/// Starts a rendering without end and waits until it renders.
#[cfg(unix)]
fn begin(folder: &Path, more: &[&str]) -> Result<std::process::Child, Box<dyn std::error::Error>> {
    let mut child = program(folder)
        .args([
            "-v",
            "render",
            "--size",
            "8",
            "--spp",
            "100000000",
            "--stats",
            "none",
            "-o",
            "out/a.exr",
        ])
        .args(more)
        .env("TMPDIR", folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let mut stderr = child.stderr.take().ok_or("no error output")?;
    let mut heard = Vec::new();
    let mut byte = [0];
    // Byte by byte, so that nothing of the rest is taken.
    while !String::from_utf8_lossy(&heard).contains("rendering;") {
        if std::io::Read::read(&mut stderr, &mut byte)? == 0 {
            return Err(format!("ended too early: {}", String::from_utf8_lossy(&heard)).into());
        }
        heard.push(byte[0]);
    }
    child.stderr = Some(stderr);
    Ok(child)
}

#[cfg(unix)]
fn interrupt(child: std::process::Child) -> Result<Output, std::io::Error> {
    Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()?;
    child.wait_with_output()
}

#[cfg(unix)]
#[test]
fn an_interrupted_picture_does_not_replace_a_better_one() -> Tested {
    let folder = tempfile::tempdir()?;
    let at = |name: &str| folder.path().join(name);
    // More samples than the interrupted picture can have, by what the file says.
    wants(
        folder.path(),
        "render --size 8 --spp 1 --stats none -o out/a.exr",
        0,
        &[],
    )?;
    let mut better = exr::read(at("out/a.exr"))?;
    better.metadata.spp = Some(1 << 40);
    exr::write(at("out/a.exr"), &better)?;
    let before = contents(&at("out"))?;
    let output = interrupt(begin(folder.path(), &[])?)?;
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert!(
        said(&output).contains("samples per pixel, the interrupted picture"),
        "{}",
        said(&output)
    );
    let after = contents(&at("out"))?;
    assert!(before.iter().all(|(path, bytes)| after[path] == *bytes));
    assert_eq!(after.len(), 6, "{:?}", after.keys());
    assert_eq!(exr::read(at("out/a-2.exr"))?.pixel_count(), 64);
    // Any is replaced with --overwrite.
    let output = interrupt(begin(folder.path(), &["--overwrite"])?)?;
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    let spp = exr::read(at("out/a.exr"))?.metadata.spp;
    assert!(spp.is_some_and(|spp| spp < 1 << 40), "{spp:?}");
    assert_eq!(count(&at("out"))?, 6);
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_picture_whose_place_is_gone_is_kept_elsewhere() -> Tested {
    let folder = tempfile::tempdir()?;
    let child = begin(folder.path(), &[])?;
    // A file where the folder would be made.
    std::fs::write(folder.path().join("out"), "no folder")?;
    let output = interrupt(child)?;
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("is kept in"), "{}", said(&output));
    let kept: Vec<PathBuf> = contents(folder.path())?
        .into_keys()
        .filter(|path| path.ends_with("a.exr"))
        .collect();
    assert_eq!(kept.len(), 1, "{}", said(&output));
    assert_eq!(exr::read(&kept[0])?.pixel_count(), 64);
    assert!(kept[0].with_extension("png").is_file() && kept[0].with_extension("json").is_file());
    Ok(())
}
