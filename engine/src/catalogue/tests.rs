//! The rows name what is there, and the checks find what is not.

use super::*;
use crate::card::sources;
use crate::transport::PathSet;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Whether the source holds a test function of that name which runs by itself.
fn has_test(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    lines.iter().enumerate().any(|(i, line)| {
        let above = lines[..i].iter().rev();
        let mut above = above.take_while(|above| above.starts_with("#[") || above.starts_with("///"));
        line.starts_with(&format!("fn {name}("))
            && above.clone().any(|attribute| *attribute == "#[test]")
            && !above.any(|attribute| attribute.starts_with("#[ignore"))
    })
}

#[test]
fn ids_are_unique_and_have_a_known_prefix() {
    let mut seen = BTreeSet::new();
    for row in all() {
        assert!(seen.insert(row.id), "{} twice", row.id);
        assert!(PREFIXES.iter().any(|prefix| row.id.starts_with(prefix)), "{}", row.id);
        assert!(!row.name.is_empty(), "{}", row.id);
    }
    let ids = ["PM-MAP-9", "PM-MAP-10", "MET-B1", "CL-GGX"].map(order);
    assert!(ids.is_sorted(), "{ids:?}");
}

/// What is wrong with the sentence that says what a row cannot do.
fn fault_of_limits(limits: &str) -> Option<&'static str> {
    let sentence = limits.strip_suffix('.').unwrap_or_default();
    if sentence.split_whitespace().count() < 3 {
        return Some("is no sentence that ends with a period");
    }
    let capital = sentence.starts_with(char::is_uppercase);
    let cells = sentence.contains(['|', '\n']);
    (!capital || cells || sentence.contains(". ")).then_some("is not one sentence for a cell of a table")
}

#[test]
fn rows_say_what_they_are_and_what_they_cannot_do() {
    let mut faults = Vec::new();
    for row in all() {
        faults.extend(fault_of_limits(row.limits).map(|fault| format!("{}: {:?} {fault}", row.id, row.limits)));
        if let Role::PartOf(of) = row.role
            && !all().iter().any(|other| other.id == of && other.id != row.id)
        {
            faults.push(format!("{}: part of {of}, which there is not", row.id));
        }
        if let Some(text) = row.path_set
            && text.parse::<PathSet>().ok().map(|set| set.to_string()).as_deref() != Some(text)
        {
            faults.push(format!("{}: no path set as it would be written: {text}", row.id));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    for wrong in [
        "",
        ".",
        "None.",
        "Slow on all scenes",
        "slow on all scenes.",
        "Slow on scenes. And wrong on them.",
    ] {
        assert!(fault_of_limits(wrong).is_some(), "{wrong:?}");
    }
    assert_eq!(fault_of_limits("Exact on all finite input."), None);
}

#[test]
fn parts_lead_to_something_that_stands_by_itself() {
    for row in all() {
        let mut whole = row;
        let mut steps = 0;
        while let Role::PartOf(of) = whole.role {
            whole = find(of).unwrap_or_else(|| panic!("{of}"));
            steps += 1;
            assert!(steps < 8, "{} is a part of itself", row.id);
        }
    }
    assert!(parts_of("PM-SYS-1").count() > 10);
}

#[test]
fn sources_have_one_key_each_and_are_used() {
    let cited = citations();
    let mut known: Vec<Source> = sources::ALL.to_vec();
    for (source, rows) in &cited {
        assert!(!source.authors.is_empty() && !source.title.is_empty(), "{}", source.key);
        assert!(
            source
                .key
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-'),
            "{}",
            source.key
        );
        for (id, _) in rows {
            let row = find(id).expect("row");
            let mut cites = row.sources.iter().filter(|cite| cite.source.key == source.key);
            assert_eq!(
                cites.next().map(|cite| cite.source),
                Some(*source),
                "two sources of one key: {}",
                source.key
            );
        }
        known.retain(|other| other.key != source.key);
    }
    assert!(known.is_empty(), "no row cites {known:?}");
    assert!(sources::ALL.is_sorted_by_key(|source| source.key), "ordered by key");
}

/// All Rust files of the workspace's crates.
fn rust_files() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = ["engine/src", "engine/tests", "tests/tests", "tools", "samples"]
        .map(|folder| repository().join(folder))
        .into();
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// What is wrong with where a test is said to be, with the files that have a test of that name.
fn fault_of_test(test: &str) -> Option<String> {
    let Some((file, name)) = test.split_once("::") else {
        return Some(format!("{test:?} is not file::function"));
    };
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    if has_test(&read(&repository().join(file)), name) {
        return None;
    }
    let elsewhere = rust_files().into_iter().filter(|path| has_test(&read(path), name));
    let elsewhere: Vec<String> = elsewhere.map(|path| path.display().to_string()).collect();
    Some(format!("no test {name} in {file}; it is in {elsewhere:?}"))
}

/// What is wrong with the command that measures a system.
fn fault_of_experiment(id: &str, command: &str) -> Option<String> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let program = match words[..] {
        [] => return Some("no experiment".into()),
        // A command is a file or a folder.
        ["clerestory", command, ..] => format!("tools/src/commands/{command}"),
        [program, ..] => program.into(),
    };
    let file = format!("{program}.rs");
    if !repository().join(&program).exists() && !repository().join(file).is_file() {
        return Some(format!("no program {program}"));
    }
    let ["clerestory", "report", ref names @ ..] = words[..] else {
        return None;
    };
    names.iter().find_map(|name| {
        let file = format!("tools/experiments/{name}.toml");
        let text = std::fs::read_to_string(repository().join(&file)).unwrap_or_default();
        let mut systems = text.lines().filter(|line| line.starts_with("systems = ["));
        let found = systems.any(|line| line.contains(&format!("\"{id}\"")));
        (!found).then(|| format!("{file} does not measure it"))
    })
}

#[test]
fn modules_tests_and_experiments_exist() {
    let mut faults = Vec::new();
    for row in all() {
        if !(row.module.starts_with("engine/src/") && repository().join(row.module).is_file()) {
            let folder = row.module.replace(".rs", "/mod.rs");
            let moved = if repository().join(&folder).is_file() {
                format!("; there is {folder}")
            } else {
                String::new()
            };
            faults.push(format!("{}: no module {}{moved}", row.id, row.module));
        }
        let shaders = row.shaders.iter().filter(|shaders| {
            let path = repository().join(shaders);
            !shaders.starts_with("shaders/")
                || !if shaders.ends_with('/') {
                    path.is_dir()
                } else {
                    path.is_file()
                }
        });
        faults.extend(shaders.map(|shaders| format!("{}: no shaders {shaders}", row.id)));
        if row.tests.is_empty() {
            faults.push(format!("{}: no test", row.id));
        }
        faults.extend(
            row.tests
                .iter()
                .filter_map(|test| fault_of_test(test))
                .map(|f| format!("{}: {f}", row.id)),
        );
        faults.extend(fault_of_experiment(row.id, row.experiment).map(|f| format!("{}: {f}", row.id)));
    }
    assert!(
        faults.is_empty(),
        "the catalogue names what is not there:\n{}",
        faults.join("\n")
    );
}

#[test]
fn tests_that_are_not_there_are_found_out() {
    let fault = fault_of_test("engine/src/lib.rs::tests_that_are_not_there_are_found_out").expect("fault");
    assert!(fault.contains("catalogue/tests.rs"), "{fault}");
    assert!(fault_of_test("engine/src/catalogue/tests.rs").is_some());
    assert!(fault_of_test("engine/src/catalogue/tests.rs::tests_that_are_not_there_are_found_out").is_none());
}

#[test]
fn experiments_that_are_not_there_are_found_out() {
    assert!(fault_of_experiment("CL-SUM", "").is_some());
    assert!(fault_of_experiment("CL-SUM", "clerestory nothing").is_some());
    assert!(fault_of_experiment("CL-SUM", "clerestory report no-such-experiment").is_some());
    assert!(fault_of_experiment("CL-SUM", "clerestory report picture-formats").is_some());
    assert!(fault_of_experiment("CL-SUM", "clerestory report sample-sums").is_none());
}

#[test]
fn every_technique_has_a_row_with_its_path_set() {
    for technique in techniques::all() {
        let row = row_of(technique).unwrap_or_else(|| panic!("no row of technique `{}`", technique.id));
        assert!(row.name.contains(&format!("`{}`", technique.id)), "{}", row.id);
        assert_eq!(
            (row.path_set, row.bias, row.needs),
            (
                Some(technique.path_set.to_string().as_str()),
                Some(technique.bias),
                technique.needs
            ),
            "{}",
            row.id
        );
        // In its own folder, as all that is listed with it.
        let folder = row.module.rsplit_once('/').map_or("", |(folder, _)| folder);
        for row in technique.rows.iter().copied().flatten() {
            assert!(row.module.starts_with(folder), "{}: {}", row.id, row.module);
        }
    }
    let own = all().iter().filter(|row| row.role == Role::Technique);
    assert_eq!(own.count(), techniques::all().len());
}

#[test]
fn the_pages_are_up_to_date() {
    for (page, text, option) in [
        ("docs/catalogue.md", markdown(), "--markdown"),
        ("third_party_notes/sources.md", sources_markdown(), "--sources"),
    ] {
        let there = std::fs::read_to_string(repository().join(page)).unwrap_or_default();
        assert!(
            there == text,
            "write it anew: cargo run -p clerestory-tools --bin clerestory -- list {option} > {page}"
        );
    }
}

/// Every file that has rows is in the list of modules or in a card's: a constant that nobody reads is a warning, but one too few in a
/// list of a folder's rows is not.
#[test]
fn no_row_is_left_out() {
    let named: BTreeSet<&str> = all().iter().map(|row| row.module).collect();
    let root = repository().canonicalize().expect("root");
    for path in sources_of_rows() {
        let file = path.canonicalize().expect("path");
        let file = file
            .strip_prefix(&root)
            .expect("in the repository")
            .display()
            .to_string();
        assert!(named.contains(file.as_str()), "the rows of {file} are in no list");
    }
}

/// The engine's files that declare rows.
fn sources_of_rows() -> Vec<PathBuf> {
    let declares = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        text.lines()
            .any(|line| line.trim_end().starts_with("pub(crate) const ROWS: &[Row]"))
    };
    let engine = repository().join("engine/src");
    let files: Vec<PathBuf> = rust_files()
        .into_iter()
        .filter(|path| path.starts_with(&engine))
        .collect();
    let found: Vec<PathBuf> = files.into_iter().filter(declares).collect();
    assert!(found.len() > 50, "{}", found.len());
    found
}

#[test]
fn scenes_of_experiments_are_compared() {
    let list = std::fs::read_to_string(repository().join("tools/src/mitsuba/scenes.rs")).expect("scenes");
    for row in all() {
        let Some((_, names)) = row.experiment.split_once("--scene ") else {
            continue;
        };
        for name in names.split(',') {
            assert!(list.contains(&format!("\"{name}\"")), "{}: {name}", row.id);
        }
    }
}

#[test]
fn only_test_functions_count() {
    let source = "#[test]\nfn real() {\n}\nfn helper() {\n}\n";
    assert!(has_test(source, "real"));
    assert!(!has_test(source, "helper") && !has_test(source, "rea"));
    assert!(!has_test("#[test]\n#[ignore = \"slow\"]\nfn idle() {\n}\n", "idle"));
}
