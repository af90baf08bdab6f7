//! The rules of the house that text alone can break: floors use only what lies below them, and pages name files that exist.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All files below a folder with one of these endings, without what builds leave behind.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)
        .expect("folder")
        .map(|entry| entry.expect("entry"))
    {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let left_out = name.starts_with('.') || ["target", "out", "shared", "node_modules"].contains(&name.as_str());
        if path.is_dir() && !left_out {
            found.extend(files(&path, endings));
        } else if path
            .extension()
            .is_some_and(|e| endings.iter().any(|ending| e == *ending))
        {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The floors from below; those of one line stand side by side and do not know each other.
const FLOORS: [&[&str]; 9] = [
    &["gpu"],
    &["kernels", "scene", "film"],
    &["accel", "maps"],
    &["raster"],
    &["transport"],
    &["walk"],
    &["techniques"],
    &["render"],
    &["plan"],
];

fn height(floor: &str) -> Option<usize> {
    FLOORS.iter().position(|names| names.contains(&floor))
}

/// The first names after each `crate::`, those in braces included.
fn modules_used(source: &str) -> BTreeSet<String> {
    names_after("crate::", source)
}

/// The first names after each `prefix`, those in braces included.
fn names_after(prefix: &str, source: &str) -> BTreeSet<String> {
    let code: String = source
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .collect();
    let mut used = BTreeSet::new();
    for after in code.split(prefix).skip(1) {
        let name = |text: &str| {
            text.trim()
                .chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        };
        let Some(group) = after.strip_prefix('{') else {
            used.insert(name(after));
            continue;
        };
        let (mut depth, mut start) = (0, 0);
        for (i, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    used.insert(name(&group[start..i]));
                    start = i + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
    }
    // A comma after the last one.
    used.remove("");
    used
}

/// The floors of the files that a shader includes.
fn floors_included(source: &str) -> BTreeSet<String> {
    let names = source
        .lines()
        .filter_map(|line| line.trim().strip_prefix("#include \""));
    names
        .filter_map(|name| Some(name.split_once('/')?.0.to_owned()))
        .collect()
}

#[test]
fn floors_use_only_what_lies_below() {
    let mut faults = Vec::new();
    let mut seen = 0;
    for (root, ending) in [
        ("engine/src", "rs"),
        ("shaders", "glsl"),
        ("shaders", "comp"),
        ("shaders", "vert"),
        ("shaders", "geom"),
        ("shaders", "frag"),
    ] {
        let root = repository().join(root);
        for path in files(&root, &[ending]) {
            let below = path.strip_prefix(&root).expect("below the root");
            let floor = below.iter().next().expect("name").to_string_lossy();
            let floor = floor.trim_end_matches(".rs");
            let Some(own) = height(floor) else { continue };
            seen += 1;
            let source = std::fs::read_to_string(&path).expect("source");
            let used = if ending == "rs" {
                modules_used(&source)
            } else {
                floors_included(&source)
            };
            let wrong = used
                .iter()
                .filter(|name| *name != floor && height(name).is_some_and(|other| other >= own));
            faults.extend(wrong.map(|name| format!("{}: {name}", path.display())));
        }
    }
    assert!(seen > 100, "{seen} files");
    assert!(faults.is_empty(), "not from below:\n{}", faults.join("\n"));
}

#[test]
fn uses_are_found_in_all_their_forms() {
    let source = "use crate::gpu::Gpu;\nuse crate::{\n    film::{a, b},\n    Error,\n};\n// crate::render\nfn f() { crate::scene::load(); }\n";
    let expected = ["Error", "film", "gpu", "scene"].map(str::to_owned);
    assert_eq!(modules_used(source).into_iter().collect::<Vec<_>>(), expected);
    assert_eq!(floors_included("#include \"film/a.glsl\"\n").len(), 1);
}

#[test]
fn every_file_of_tests_is_part_of_a_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut left_out = Vec::new();
    let mut seen = 0;
    for path in files(&folder, &["rs"]) {
        let below = path.strip_prefix(&folder).expect("below the folder");
        let name = path.file_stem().expect("name").to_string_lossy();
        // What lies in the folder itself cargo finds, as it does each folder's main.rs.
        if below.components().count() == 1 || name == "main" {
            continue;
        }
        seen += 1;
        let parent = path.parent().expect("folder");
        let declaring = [
            parent.join("main.rs"),
            parent.join("mod.rs"),
            parent.with_extension("rs"),
        ];
        let source: String = declaring
            .iter()
            .filter_map(|file| std::fs::read_to_string(file).ok())
            .collect();
        if !source.lines().any(|line| line.trim() == format!("mod {name};")) {
            left_out.push(below.display().to_string());
        }
    }
    assert!(seen > 80, "{seen} files");
    assert!(left_out.is_empty(), "in no program: {}", left_out.join(", "));
}

/// Ways to open a file that look neither at its kind nor at its length.
const OTHER_DOORS: [&str; 5] = [
    "fs::read",
    "File::open",
    "OpenOptions",
    "ImageReader::open",
    "_from_file(",
];

/// Places in the tools that read what no person names: what they have written themselves, what a program that they started has, and the system's own
/// counts.
const OWN_FILES: [&str; 10] = [
    "tools/src/agreement/",
    "tools/src/cycles/peer.rs",
    "tools/src/experiments/json_lines.rs",
    "tools/src/experiments/measures/photon_maps/construction_stages.rs",
    "tools/src/experiments/pages/",
    "tools/src/fuzzing/",
    "tools/src/json_file.rs",
    "tools/src/machine.rs",
    "tools/src/outputs/lock.rs",
    "tools/src/page.rs",
];

#[test]
fn files_that_others_name_are_read_through_one_door() {
    let root = repository();
    let mut seen = 0;
    for folder in ["engine/src/scene", "engine/src/film", "tools/src"] {
        for path in files(&root.join(folder), &["rs"]) {
            let source = std::fs::read_to_string(&path).expect("source");
            let below = path.strip_prefix(&root).expect("below the root");
            let is_test = below.iter().any(|part| part == "tests" || part == "tests.rs");
            let code = source.split("#[cfg(test)]").next().unwrap_or_default();
            // Names alone.
            let code = code.replace("fs::read_dir", "");
            let is_own = OWN_FILES.iter().any(|place| below.to_string_lossy().starts_with(place));
            if is_test || is_own {
                continue;
            }
            seen += 1;
            for door in OTHER_DOORS {
                assert!(
                    !code.contains(door),
                    "{}: {door} in place of crate::input",
                    path.display()
                );
            }
        }
    }
    assert!(seen > 150, "{seen} files");
}

/// Methods that may use another one's code and kernels: photon mapping's eye paths are the path tracer's, as are those that virtual lights light, which walks
/// leave as photons do; bidirectional paths have the path tracer's camera rays and way to the film. Pictures by maps with distances are eye paths, too, and a
/// localised gather has the same maps, which the preview's kernel shades.
const METHODS_BESIDE: [[&str; 2]; 8] = [
    ["bidirectional", "path"],
    ["photon_mapping", "path"],
    ["instant_radiosity", "path"],
    ["instant_radiosity", "photon_mapping"],
    ["impostors", "path"],
    ["impostors", "preview"],
    ["localized_gather", "path"],
    ["localized_gather", "impostors"],
];

#[test]
fn methods_do_not_know_each_other() {
    let root = repository().join("engine/src/techniques");
    let methods: BTreeSet<String> = std::fs::read_dir(&root)
        .expect("folder")
        .map(|entry| entry.expect("entry").path())
        .filter(|path| path.is_dir())
        .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
        .collect();
    assert!(methods.len() > 3, "{methods:?}");
    let mut faults = Vec::new();
    let mut allowed = BTreeSet::new();
    for method in &methods {
        let files = [
            (files(&root.join(method), &["rs"]), "techniques::"),
            (
                files(&repository().join("shaders/techniques").join(method), &["glsl", "comp"]),
                "#include \"techniques/",
            ),
        ];
        for (files, prefix) in files {
            for path in files {
                let used = names_after(prefix, &std::fs::read_to_string(&path).expect("source"));
                for other in used.iter().filter(|name| *name != method && methods.contains(*name)) {
                    let pair = [method.as_str(), other.as_str()];
                    match METHODS_BESIDE.iter().position(|known| *known == pair) {
                        Some(known) => _ = allowed.insert(known),
                        None => faults.push(format!("{}: {other}", path.display())),
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "methods use others:\n{}", faults.join("\n"));
    assert_eq!(allowed.len(), METHODS_BESIDE.len(), "a pair is not needed any more");
    let found = names_after("techniques::", "use crate::techniques::{Card, path::Wave, preview};");
    assert!(found.contains("path") && found.contains("preview"), "{found:?}");
}

/// What methods named `record` must not do, since a host's command buffer may be what they record into: submit, wait, move data by the
/// host, allocate, compile.
const NOT_WHILE_RECORDING: [&str; 11] = [
    ".submit(",
    ".submit_with(",
    ".wait(",
    ".wait_for(",
    ".recorder(",
    "gpu.read(",
    "gpu.read::",
    "gpu.upload(",
    "gpu.buffer(",
    ".buffer_with(",
    ".compute_pipeline(",
];

/// The bodies of functions named `record` or `record_…`, formatted as rustfmt does, with their names.
fn recording(source: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = source.lines().collect();
    let named = |line: &str| {
        let (_, after) = line.split_once("fn record")?;
        let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let is_one = (name.is_empty() || name.starts_with('_')) && !line.trim_start().starts_with("//");
        is_one.then(|| format!("record{name}"))
    };
    let begins = lines.iter().enumerate();
    let found = begins.filter_map(|(at, line)| Some((at, named(line)?)));
    found
        .map(|(at, name)| {
            let indent = lines[at].len() - lines[at].trim_start().len();
            let end = format!("{}}}", " ".repeat(indent));
            let body: Vec<&str> = lines[at..].iter().copied().take_while(|line| **line != *end).collect();
            (name, body.join("\n"))
        })
        .collect()
}

#[test]
fn what_records_neither_submits_nor_waits_nor_allocates() {
    let mut count = 0;
    for path in files(&repository().join("engine/src"), &["rs"]) {
        let source = std::fs::read_to_string(&path).expect("source");
        for (name, body) in recording(&source) {
            count += 1;
            for call in NOT_WHILE_RECORDING {
                assert!(!body.contains(call), "{}: {name} calls {call}", path.display());
            }
        }
    }
    assert!(count > 50, "{count} functions");
    let bad = "impl A {\n    pub fn record(&self) {\n        x.submit();\n    }\n}\n";
    assert!(recording(bad)[0].1.contains(NOT_WHILE_RECORDING[0]));
}

/// Whether the text between back-quotes is meant as a file or folder of the repository.
fn is_path(text: &str) -> bool {
    const FOLDERS: [&str; 8] = [
        "engine/",
        "shaders/",
        "tests/",
        "tools/",
        "samples/",
        "docs/",
        "third_party_notes/",
        ".github/",
    ];
    const ENDINGS: [&str; 7] = [".rs", ".glsl", ".comp", ".py", ".sh", ".md", ".toml"];
    let plain = text.chars().all(|c| c.is_alphanumeric() || "/._-".contains(c));
    plain
        && (FOLDERS.iter().any(|folder| text.starts_with(folder))
            || text.contains('/') && ENDINGS.iter().any(|ending| text.ends_with(ending)))
}

#[test]
fn pages_name_files_that_exist() {
    let root = repository();
    let mut faults = Vec::new();
    let mut seen = 0;
    for page in files(&root, &["md"]) {
        let text = std::fs::read_to_string(&page).expect("page");
        // Code blocks show commands and files of the reader.
        let prose: String = text.split("\n```").step_by(2).collect::<Vec<_>>().join("\n");
        let beside = page.parent().expect("folder");
        let quoted = prose.split('`').skip(1).step_by(2);
        // A command's first word is its program, and a test's file stands before `::`.
        let quoted = quoted.filter_map(|text| text.split_whitespace().next()?.split("::").next());
        for name in quoted.filter(|name| is_path(name) && !name.starts_with("out/")) {
            seen += 1;
            let roots = ["", "engine/src", "shaders"].map(|below| root.join(below));
            if !roots.iter().any(|folder| folder.join(name).exists()) && !beside.join(name).exists() {
                faults.push(format!("{}: `{name}`", page.display()));
            }
        }
        let links = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let pictures = prose.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next());
        for link in links.chain(pictures) {
            let file = link.split('#').next().unwrap_or_default();
            if !link.contains("://") && !file.is_empty() && !beside.join(file).exists() {
                faults.push(format!("{}: link to {link}", page.display()));
            }
        }
    }
    assert!(seen > 50, "{seen} paths");
    assert!(
        faults.is_empty(),
        "pages name what is not there:\n{}",
        faults.join("\n")
    );
}
