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
    for (name, file) in [("alpha", "rows.json"), ("roulette", "1.csv"), ("absorption", "map.svg")] {
        std::fs::create_dir_all(at("pages").join(name))?;
        std::fs::write(at("pages").join(name).join(file), "[1, 2]\n")?;
    }
    std::fs::create_dir(at("results"))?;
    std::fs::write(at("results/README.md"), "# Results\n\nOf somebody's project.\n")?;
    // A report of the program's with somebody's words beside it.
    let report = "{\"device\": \"d\", \"driver\": \"e\", \"engine_version\": \"0.1.0\"}";
    std::fs::create_dir(at("own"))?;
    std::fs::write(at("own/index.json"), report)?;
    std::fs::write(at("own/index.md"), "# Words\n")?;
    std::fs::write(at("protected.md"), "# Words\n")?;
    let mut permissions = at("protected.md").metadata()?.permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(at("protected.md"), permissions)?;
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
const REFUSED: [(&str, &str); 50] = [
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
    ("report alpha --folder pages", "did not write it"),
    ("report roulette --folder pages", "did not write it"),
    ("report absorption --folder pages", "did not write it"),
    (
        "report kd-or-bvh --scene tables/sort.json --folder new --references tables",
        "lies in the folder",
    ),
    (
        "report tables/tiny/tiny.toml --references tables --folder new",
        "lies in the folder",
    ),
    (
        "report tables/tiny/tiny.toml --references tables/tiny/tiny.toml --folder new",
        "lies in the folder",
    ),
    ("report --pages", "did not write it"),
    ("report samplers --results --folder new", "did not write it"),
    ("stability empty-scene --pictures tables", "did not write it"),
    (
        "agreement --python tables/notes.md --output tables",
        "lies in the folder",
    ),
    ("agreement --python own/index.md --results own/index", "reads it"),
    ("agreement --python own/index.md --page own/index.md", "reads it"),
    ("agreement --python true --results package", "did not write it"),
    // A page is read, too: what stands around the part that is replaced.
    (
        "agreement --python true --results own/index --page own/index.md",
        "reads it",
    ),
    (
        "agreement --python true --results new/a --page new/a.md --output out",
        "reads it",
    ),
    (
        "agreement --python true --output own --page own/index.md",
        "lies in the folder",
    ),
    ("agreement --python true --page protected.md", "write-protected"),
    (
        "index --peers --scene soup.obj --folder own --page own/index.md",
        "reads it",
    ),
    (
        "index --peers --scene soup.obj --folder own --page new/../own/index.md --overwrite",
        "reads it",
    ),
    (
        "index --peers --scene soup.obj --folder new --page ./new/index.md",
        "reads it",
    ),
    ("index --peers --scene soup.obj --page protected.md", "write-protected"),
    ("index --peers --scene own/index.md --folder own", "reads it"),
    ("bench --sort --scene tables/sort.json --folder tables", "reads it"),
    ("bench --sort --scene own/index.md --page own/index.md", "reads it"),
    ("bench --sort --page protected.md", "write-protected"),
    ("metal own/index.md --sphere own/index.md", "reads it"),
    ("metal gold --sphere protected.md", "write-protected"),
];

/// Commands that go on where the place for what they would keep is one of their inputs.
const GOES_ON: [&str; 2] = [
    "render --spp 1 --reference a.exr --index kd --index-cache a.exr --stats none -o new.exr",
    "index --scene soup.obj --index-cache soup.obj --repeat 1 --rays 2",
];

/// Options whose names are no files.
const NO_FILES: [[&str; 2]; 2] = [["render", "--camera"], ["agreement", "--scene"]];
/// Options without a value that write.
const WRITING: [[&str; 2]; 2] = [["report", "--results"], ["report", "--pages"]];

/// The options of a command's help that take a file or a folder, by all of their names.
fn options_of_files(help: &str) -> Vec<Vec<&str>> {
    let mut found = Vec::new();
    for line in help.lines().map(str::trim).filter(|line| line.starts_with('-')) {
        let Some((names, value)) = line.split_once('<') else {
            continue;
        };
        let value = value.split('>').next().unwrap_or_default();
        if value.contains("FILE") || value.contains("FOLDER") || value == "NAME" {
            found.push(names.split([' ', ',']).filter(|name| !name.is_empty()).collect());
        }
    }
    found
}

#[test]
fn no_command_writes_over_what_it_reads_or_what_is_not_its_own() -> Tested {
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    let before = contents(folder.path())?;
    for (line, word) in REFUSED {
        wants(folder.path(), line, 2, &["error:", word])?;
        assert!(contents(folder.path())? == before, "{line} changed a file");
    }
    // Each command of the help that can write stands above: all that take --overwrite. So does each of their options that takes a file.
    let help = program(folder.path()).arg("--help").output()?;
    let help = String::from_utf8(help.stdout)?;
    // Continued lines are indented further.
    let named = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let commands = help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let commands = commands
        .take_while(|line| !line.is_empty())
        .filter(named)
        .filter_map(|line| line.split_whitespace().next());
    let lines = || REFUSED.iter().map(|(line, _)| *line).chain(GOES_ON);
    let tried = |command: &str, names: &[&str]| {
        let of_command = |line: &&str| line.split(' ').next() == Some(command);
        let mut lines = lines().filter(of_command);
        lines.any(|line| line.split(' ').any(|word| names.contains(&word)))
    };
    let mut seen = 0;
    for command in commands.filter(|command| *command != "help") {
        let options = program(folder.path()).args([command, "--help"]).output()?;
        let options = String::from_utf8(options.stdout)?;
        let writes = options.contains("--overwrite");
        assert_eq!(writes, tried(command, &[command]), "{command}");
        for names in options_of_files(&options) {
            let is_exempt = NO_FILES.iter().any(|[of, name]| *of == command && names.contains(name));
            assert!(tried(command, &names) != is_exempt, "{command} {names:?}");
        }
        seen += 1;
    }
    for [command, name] in WRITING {
        assert!(tried(command, &[name]), "{command} {name}");
    }
    assert!(seen >= 11, "{seen} commands: {help}");
    Ok(())
}

/// What cannot be kept is only said.
#[test]
fn caches_in_place_of_an_input_change_nothing() -> Tested {
    let folder = tempfile::tempdir()?;
    fill(folder.path())?;
    let before = contents(folder.path())?;
    for line in GOES_ON {
        wants(folder.path(), line, 0, &[])?;
        let after = contents(folder.path())?;
        assert!(
            before.iter().all(|(path, bytes)| after.get(path) == Some(bytes)),
            "{line}"
        );
    }
    Ok(())
}

#[test]
fn pages_of_results_are_made_where_they_are_the_programs() -> Tested {
    let folder = tempfile::tempdir()?;
    let list = folder.path().join("results/README.md");
    std::fs::create_dir(folder.path().join("results"))?;
    std::fs::write(&list, "# Results\n\nOf somebody's project.\n")?;
    wants(
        folder.path(),
        "report --pages",
        2,
        &["results/README.md", "did not write it"],
    )?;
    assert_eq!(count(&folder.path().join("results"))?, 1);
    wants(folder.path(), "report --pages --overwrite", 0, &["wrote results"])?;
    // Its own are replaced unasked, unless they are write-protected.
    let own = std::fs::read_to_string(&list)?;
    std::fs::write(&list, own.clone() + "more\n")?;
    wants(folder.path(), "report --pages", 0, &[])?;
    assert!(own.contains("(samplers/README.md)") && std::fs::read_to_string(&list)? == own);
    let mut permissions = list.metadata()?.permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&list, permissions)?;
    wants(
        folder.path(),
        "report --pages",
        2,
        &["results/README.md", "write-protected"],
    )?;
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

/// Of what took long to measure at least the words are left.
#[cfg(target_os = "linux")]
#[test]
fn what_an_experiment_found_is_printed_where_it_cannot_be_written() -> Tested {
    let folder = tempfile::tempdir()?;
    let program = env!("CARGO_BIN_EXE_clerestory");
    let mut shell = Command::new("sh");
    let line = format!("ulimit -f 1; exec {program} report phase-functions --smoke --folder new");
    let output = shell
        .args(["-c", &line])
        .current_dir(folder.path())
        .env("TMPDIR", folder.path())
        .stdin(Stdio::null())
        .output()?;
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("ulimit -f") && said(&output).contains("nor could it"),
        "{}",
        said(&output)
    );
    let printed = String::from_utf8(output.stdout)?;
    assert!(
        printed.starts_with("# phase-functions") && printed.contains("| "),
        "{printed}"
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
    let line = "-v render --size 8 --spp 100000000 --stats none -o out/a.exr";
    let arguments: Vec<&str> = line.split(' ').chain(more.iter().copied()).collect();
    begin_until(folder, &arguments, "rendering;")
}

/// Starts the program and waits until it says a word.
#[cfg(unix)]
fn begin_until(
    folder: &Path,
    arguments: &[&str],
    word: &str,
) -> Result<std::process::Child, Box<dyn std::error::Error>> {
    let mut child = program(folder)
        .args(arguments)
        .env("TMPDIR", folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()?;
    let mut stderr = child.stderr.take().ok_or("no error output")?;
    let mut heard = Vec::new();
    let mut byte = [0];
    // Byte by byte, so that nothing of the rest is taken.
    while !String::from_utf8_lossy(&heard).contains(word) {
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

/// The tree takes far longer than the signal.
#[cfg(unix)]
#[test]
fn an_interrupt_while_the_index_is_built_ends_the_program() -> Tested {
    use std::os::unix::process::ExitStatusExt;
    let folder = tempfile::tempdir()?;
    let line = "-v render builtin:triangle-soup?n=200000 --index kd --size 8 --spp 1 --stats none -o out/a.exr";
    let arguments: Vec<&str> = line.split(' ').collect();
    let output = interrupt(begin_until(folder.path(), &arguments, "device=")?)?;
    assert_eq!(output.status.signal(), Some(2), "{}", said(&output));
    assert!(!said(&output).contains("rendering;"), "{}", said(&output));
    assert_eq!(count(folder.path())?, 0);
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
