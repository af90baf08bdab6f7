//! The rows name what is there, and the checks find what is not.

use super::*;
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
        assert!(
            ["BG-", "DP-", "OEM-", "PM-", "MET-", "CL-"]
                .iter()
                .any(|prefix| row.id.starts_with(prefix)),
            "{}",
            row.id
        );
        assert!(!row.name.is_empty() && !row.publication.is_empty(), "{}", row.id);
    }
}

/// All Rust files of the workspace's crates.
fn sources() -> Vec<PathBuf> {
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
    let elsewhere = sources().into_iter().filter(|path| has_test(&read(path), name));
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
    for technique in crate::techniques::all() {
        let row = all()
            .iter()
            .find(|row| row.name.contains(&format!("`{}`", technique.id)));
        let row = row.unwrap_or_else(|| panic!("no row names technique `{}`", technique.id));
        assert_eq!(
            (row.path_set, row.bias),
            (Some(technique.path_set), Some(technique.bias)),
            "{}",
            row.id
        );
    }
}

#[test]
fn the_page_is_up_to_date() {
    let page = std::fs::read_to_string(repository().join("docs/catalogue.md")).unwrap_or_default();
    assert!(
        page == markdown(),
        "write it anew: cargo run -p clerestory-tools --bin clerestory -- list --markdown > docs/catalogue.md"
    );
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
