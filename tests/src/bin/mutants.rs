//! What tools/mutants works through, a line each: the Rust files of the floors whose results are numbers, and the patches of shaders in
//! `tools/mutations/`, with the tests of their rows in the catalogue.
//!
//! Fields are divided by tabs: `rust`, `patch`, or `none` for a file that no row has tests for; the path from the repository's root; packages and
//! targets of the tests, divided by spaces; the tests as a filter of cargo-nextest. Run from the repository's root.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::ExitCode;

use clerestory::catalogue::{self, Row};

/// Folders of `engine/src/` whose files are mutated.
const FLOORS: [&str; 5] = ["accel", "film", "plan", "techniques", "transport"];
const PATCHES: &str = "tools/mutations";
/// What the first line of a patch begins with; its row's id follows.
const ROW: &str = "row: ";

/// Where a test is: its package, and what chooses its program on the command line and in a filter.
type Place = (&'static str, String, String);

fn place(file: &str) -> Option<Place> {
    let parts: Vec<&str> = file.split('/').collect();
    let package = match parts.first() {
        Some(&"engine") => "clerestory",
        Some(&"tests") => "clerestory-tests",
        Some(&"tools") => "clerestory-tools",
        Some(&"samples") => "clerestory-samples",
        _ => return None,
    };
    match parts.as_slice() {
        ["engine", "src", ..] => Some((package, "--lib".into(), "kind(=lib)".into())),
        [_, "tests", program, ..] => {
            let program = program.trim_end_matches(".rs");
            Some((package, format!("--test={program}"), format!("binary(={program})")))
        }
        _ => None,
    }
}

/// Packages and targets, and the filter, of tests as the catalogue names them; `None` without any that can be chosen. `wanted` says which files
/// count.
fn selection(tests: &[&str], wanted: impl Fn(&str) -> bool) -> Option<[String; 2]> {
    let mut functions: BTreeMap<Place, BTreeSet<&str>> = BTreeMap::new();
    for test in tests {
        if let Some((file, function)) = test.split_once("::")
            && wanted(file)
            && let Some(place) = place(file)
        {
            functions.entry(place).or_default().insert(function);
        }
    }
    let options: BTreeSet<String> = functions
        .keys()
        .flat_map(|(package, target, _)| [format!("--package={package}"), target.clone()])
        .collect();
    let options: Vec<String> = options.into_iter().collect();
    let filters = functions.iter().map(|((package, _, program), functions)| {
        let names: Vec<&str> = functions.iter().copied().collect();
        format!(
            "(package(={package}) & {program} & test(/(^|::)({})$/))",
            names.join("|")
        )
    });
    let filters: Vec<String> = filters.collect();
    (!filters.is_empty()).then(|| [options.join(" "), filters.join(" | ")])
}

/// The folder that a module's parts are in.
fn folder(module: &str) -> String {
    let stem = module.strip_suffix("/mod.rs").or(module.strip_suffix(".rs"));
    format!("{}/", stem.unwrap_or(module))
}

/// The rows of a file: its own, else those of the nearest module that it is a part of.
fn rows_of(file: &str) -> Vec<&'static Row> {
    let all = || catalogue::all().iter();
    let own: Vec<_> = all().filter(|row| row.module == file).collect();
    if !own.is_empty() {
        return own;
    }
    let around = || all().filter(|row| file.starts_with(&folder(row.module)));
    let nearest = around().map(|row| folder(row.module).len()).max();
    around()
        .filter(|row| Some(folder(row.module).len()) == nearest)
        .collect()
}

/// Whether a file holds tests or what only tests use.
fn is_of_tests(file: &str) -> bool {
    let name = file.rsplit('/').next().unwrap_or(file);
    file.contains("/tests/")
        || ["tests.rs", "testing.rs", "test_support.rs"].contains(&name)
        || name.ends_with("_tests.rs")
}

/// All files below a folder with this ending, in order.
fn files(folder: &str, ending: &str) -> std::io::Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let name = format!("{folder}/{}", entry?.file_name().to_string_lossy());
        if Path::new(&name).is_dir() {
            found.extend(files(&name, ending)?);
        } else if name.ends_with(ending) {
            found.push(name);
        }
    }
    found.sort();
    Ok(found)
}

fn lines() -> Result<Vec<String>, String> {
    let told = |error: std::io::Error| error.to_string();
    let mut lines = Vec::new();
    for floor in FLOORS {
        let all = files(&format!("engine/src/{floor}"), ".rs").map_err(told)?;
        for file in all.into_iter().filter(|file| !is_of_tests(file)) {
            let tests: Vec<&str> = rows_of(&file).into_iter().flat_map(|row| row.tests).copied().collect();
            lines.push(match selection(&tests, |_| true) {
                Some([options, filter]) => format!("rust\t{file}\t{options}\t{filter}"),
                None => format!("none\t{file}"),
            });
        }
    }
    for file in files(PATCHES, ".patch").map_err(told)? {
        let text = std::fs::read_to_string(&file).map_err(told)?;
        let id = text.lines().next().and_then(|line| line.strip_prefix(ROW));
        let row = id.and_then(catalogue::find).ok_or(format!("{file}: names no row"))?;
        // What runs on the host alone sees no shader.
        let [options, filter] = selection(row.tests, |file| !file.starts_with("engine/"))
            .ok_or(format!("{file}: {} has no test on the device", row.id))?;
        lines.push(format!("patch\t{file}\t{options}\t{filter}"));
    }
    Ok(lines)
}

fn main() -> ExitCode {
    match lines() {
        Ok(lines) => {
            lines.iter().for_each(|line| println!("{line}"));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("mutants: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_are_chosen_by_their_programs_and_names() {
        let tests = [
            "tests/tests/photon/queues.rs::one",
            "tests/tests/photon/maps.rs::two",
            "tests/tests/kd.rs::three",
            "engine/src/accel/kd/tests.rs::four",
        ];
        let [options, filter] = selection(&tests, |_| true).unwrap();
        assert_eq!(
            options,
            "--lib --package=clerestory --package=clerestory-tests --test=kd --test=photon"
        );
        assert_eq!(
            filter,
            "(package(=clerestory) & kind(=lib) & test(/(^|::)(four)$/)) | \
             (package(=clerestory-tests) & binary(=kd) & test(/(^|::)(three)$/)) | \
             (package(=clerestory-tests) & binary(=photon) & test(/(^|::)(one|two)$/))"
        );
        let [options, _] = selection(&tests, |file| !file.starts_with("engine/")).unwrap();
        assert_eq!(options, "--package=clerestory-tests --test=kd --test=photon");
        assert_eq!(selection(&[], |_| true), None);
    }

    #[test]
    fn files_have_the_rows_of_the_nearest_module() {
        let ids = |file: &str| rows_of(file).iter().map(|row| row.id).collect::<Vec<_>>();
        assert!(ids("engine/src/transport/fresnel.rs").contains(&"CL-FRESNEL"));
        assert!(ids("engine/src/techniques/photon_mapping/queue.rs").contains(&"PM-ST-4"));
        assert!(ids("engine/src/nothing/here.rs").is_empty());
        assert!(is_of_tests("engine/src/accel/kd/tests.rs") && !is_of_tests("engine/src/accel/kd.rs"));
    }

    #[test]
    fn every_patch_has_a_row_with_tests_on_the_device() {
        std::env::set_current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")).unwrap();
        let lines = lines().unwrap_or_else(|error| panic!("{error}"));
        let count = |kind: &str| lines.iter().filter(|line| line.starts_with(kind)).count();
        assert!(count("patch\t") >= 3 && count("rust\t") > 50, "{lines:#?}");
    }
}
