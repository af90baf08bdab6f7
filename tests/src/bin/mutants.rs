//! What tools/mutants asks of the catalogue: the tests of each row, a line each.
//!
//! Fields are divided by tabs: the row's id; `host` for tests of the engine's own, which see no shader, and `device` for all others; options that build
//! the test's program, divided by spaces; the program's name, `package` for the engine's own and `package::program` for others; the test's function.

use clerestory::catalogue::{self, Row};

/// Of a test's file: the options that build its program, and that program's name; `None` for files whose tests tools/mutants does not run.
fn place(file: &str) -> Option<[String; 2]> {
    let parts: Vec<&str> = file.split('/').collect();
    let package = match parts.first() {
        Some(&"engine") => "clerestory",
        Some(&"tests") => "clerestory-tests",
        Some(&"tools") => "clerestory-tools",
        Some(&"samples") => "clerestory-samples",
        _ => return None,
    };
    match parts.as_slice() {
        ["engine", "src", ..] => Some([format!("--package={package} --lib"), package.into()]),
        [_, "tests", program, ..] => {
            let program = program.trim_end_matches(".rs");
            let options = format!("--package={package} --test={program}");
            Some([options, format!("{package}::{program}")])
        }
        _ => None,
    }
}

/// The lines of a row.
fn lines(row: &Row) -> impl Iterator<Item = String> + '_ {
    row.tests.iter().filter_map(|test| {
        let (file, function) = test.split_once("::")?;
        let [options, program] = place(file)?;
        let kind = if file.starts_with("engine/") { "host" } else { "device" };
        Some(format!("{}\t{kind}\t{options}\t{program}\t{function}", row.id))
    })
}

fn main() {
    for line in catalogue::all().iter().flat_map(lines) {
        println!("{line}");
    }
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::*;

    #[test]
    fn tests_are_named_by_their_programs() {
        let of = |file: &str| place(file).map(|[options, program]| format!("{options} | {program}"));
        assert_eq!(
            of("tests/tests/photon/queues.rs").unwrap(),
            "--package=clerestory-tests --test=photon | clerestory-tests::photon"
        );
        assert_eq!(
            of("tools/tests/maps.rs").unwrap(),
            "--package=clerestory-tools --test=maps | clerestory-tools::maps"
        );
        assert_eq!(
            of("engine/src/accel/kd/tests.rs").unwrap(),
            "--package=clerestory --lib | clerestory"
        );
        assert_eq!(of("docs/reference.md"), None);
        let row = catalogue::find("CL-FRESNEL").unwrap();
        let lines: Vec<String> = lines(row).collect();
        assert_eq!(lines.len(), row.tests.len());
        assert!(lines.iter().any(|line| line.starts_with("CL-FRESNEL\thost\t")));
        assert!(lines.iter().any(|line| line.starts_with("CL-FRESNEL\tdevice\t")));
    }

    /// The values of `path = "…"` and `row = "…"` in the lists of faults.
    fn values(text: &str, key: &str) -> Vec<String> {
        let value = |line: &str| {
            Some(
                line.strip_prefix(key)?
                    .strip_prefix(" = \"")?
                    .strip_suffix('"')?
                    .to_owned(),
            )
        };
        text.lines().filter_map(value).collect()
    }

    #[test]
    fn every_fault_has_a_row_with_tests_that_see_it() {
        let root: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let mut files = 0;
        for entry in std::fs::read_dir(root.join("tools/mutations")).unwrap() {
            let text = std::fs::read_to_string(entry.unwrap().path()).unwrap();
            let (paths, rows) = (values(&text, "path"), values(&text, "row"));
            assert_eq!(paths.len(), rows.len());
            for (path, id) in paths.iter().zip(&rows) {
                assert!(root.join(path).is_file(), "{path}");
                let row = catalogue::find(id).unwrap_or_else(|| panic!("{path}: {id} is no row"));
                let sees = |line: &String| path.ends_with(".rs") || line.contains("\tdevice\t");
                assert!(lines(row).any(|line| sees(&line)), "{path}: no test of {id} sees it");
                files += 1;
            }
        }
        assert!(files >= 80, "{files}");
    }
}
