//! The house's rules that are read from the program's code.

use std::path::{Path, PathBuf};

/// Ways to write that know nothing of a plan, and lose what cannot be written.
const OTHER_WAYS_OUT: [&str; 7] = [
    "atomic::write",
    "fs::write",
    "fs::copy",
    "fs::create_dir",
    "png::write(",
    "exr::write(",
    "hdr::write(",
];
/// Ways to open a file that look neither at its kind nor at its length.
const OTHER_WAYS_IN: [&str; 3] = ["fs::read_to_string", "fs::read(", "File::open"];
/// Code that reads what the system or the program itself keeps.
const OF_THE_SYSTEM: [&str; 7] = [
    "machine.rs",
    "agreement/race.rs",
    "agreement/peer.rs",
    "cycles/peer.rs",
    "outputs/lock.rs",
    "fuzzing",
    "experiments/measures",
];

fn sources(folder: &Path) -> Result<Vec<PathBuf>, std::io::Error> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(sources(&path)?);
        } else {
            found.push(path);
        }
    }
    Ok(found)
}

/// Looks for words in all code but that of tests; returns the number of files.
fn refuse(folder: &str, words: &[&str], exempt: &[&str]) -> Result<usize, std::io::Error> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = 0;
    for path in sources(&root.join(folder))? {
        let below = path.strip_prefix(&root).unwrap_or(&path);
        if exempt.iter().any(|place| below.starts_with(place)) || below.ends_with("tests.rs") {
            continue;
        }
        let source = std::fs::read_to_string(&path)?;
        let code = source.split("#[cfg(test)]").next().unwrap_or_default();
        for word in words {
            assert!(!code.contains(word), "{}: {word}", below.display());
        }
        seen += 1;
    }
    Ok(seen)
}

#[test]
fn commands_write_by_their_plans_alone() -> Result<(), std::io::Error> {
    assert!(refuse("commands", &OTHER_WAYS_OUT, &[])? > 25);
    Ok(())
}

#[test]
fn files_that_others_name_are_read_through_one_door() -> Result<(), std::io::Error> {
    assert!(refuse("", &OTHER_WAYS_IN, &OF_THE_SYSTEM)? > 80);
    Ok(())
}
