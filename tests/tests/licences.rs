//! Every dependency's licence is one of those that `deny.toml` allows.
//!
//! Offline: `cargo metadata` on the lock file, and the SPDX expressions evaluated here (AND, OR, WITH, parentheses; `/` as the old
//! form of OR). An unknown word, a missing licence or a syntax error fails. The crates used directly have their line in
//! `third_party_notes/crates.md`, and every page of notes is in the index.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Whether the allowed licences satisfy an expression; an error for one that cannot be read.
fn satisfied(expression: &str, allowed: &BTreeSet<String>) -> Result<bool, String> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = words.as_slice();
    let value = any_of(&mut rest, allowed)?;
    match rest {
        [] => Ok(value),
        [word, ..] => Err(format!("unexpected {word:?} in {expression:?}")),
    }
}

fn any_of(words: &mut &[&str], allowed: &BTreeSet<String>) -> Result<bool, String> {
    let mut value = all_of(words, allowed)?;
    while let ["OR", rest @ ..] = *words {
        *words = rest;
        value |= all_of(words, allowed)?;
    }
    Ok(value)
}

fn all_of(words: &mut &[&str], allowed: &BTreeSet<String>) -> Result<bool, String> {
    let mut value = one(words, allowed)?;
    while let ["AND", rest @ ..] = *words {
        *words = rest;
        value &= one(words, allowed)?;
    }
    Ok(value)
}

fn one(words: &mut &[&str], allowed: &BTreeSet<String>) -> Result<bool, String> {
    match *words {
        ["(", rest @ ..] => {
            *words = rest;
            let value = any_of(words, allowed)?;
            let [")", rest @ ..] = *words else {
                return Err("a parenthesis is not closed".into());
            };
            *words = rest;
            Ok(value)
        }
        [licence, "WITH", exception, rest @ ..] => {
            *words = rest;
            Ok(allowed.contains(&format!("{licence} WITH {exception}")))
        }
        [licence, rest @ ..] if !["OR", "AND", "WITH", ")"].contains(licence) => {
            *words = rest;
            Ok(allowed.contains(*licence))
        }
        _ => Err("a licence is missing".into()),
    }
}

/// The strings of the `allow` list of `deny.toml`.
fn allow_list(root: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(root.join("deny.toml")).expect("deny.toml");
    let list = text.split_once("\nallow = [").expect("a list of licences").1;
    let list = list.split_once(']').expect("its end").0;
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_dependency_has_an_allowed_licence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let allowed = allow_list(&root);
    assert!(allowed.contains("MIT") && allowed.contains("Apache-2.0"), "{allowed:?}");
    let output = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--format-version",
            "1",
            "--locked",
            "--offline",
            "--filter-platform",
        ])
        .arg(host())
        .current_dir(&root)
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    assert!(packages.len() > 50, "{} packages", packages.len());
    let refused: Vec<String> = packages
        .iter()
        .filter_map(|package| {
            let name = format!("{} {}", package["name"], package["version"]);
            match package["license"].as_str() {
                None => Some(format!("{name}: no licence")),
                Some(expression) => match satisfied(expression, &allowed) {
                    Ok(true) => None,
                    Ok(false) => Some(format!("{name}: {expression}")),
                    Err(error) => Some(format!("{name}: {expression}: {error}")),
                },
            }
        })
        .collect();
    assert!(refused.is_empty(), "{refused:#?}");
}

/// The platform whose packages a build here has fetched: others may be absent offline.
fn host() -> String {
    let output = Command::new("rustc").arg("-vV").output().expect("rustc runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let name = text.lines().find_map(|line| line.strip_prefix("host: "));
    name.expect("rustc names its host").to_owned()
}

#[test]
fn crates_used_directly_and_pages_of_notes_are_listed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("file");
    let manifest = read("Cargo.toml");
    let list = manifest.split_once("[workspace.dependencies]").expect("dependencies").1;
    let list = list.split_once("\n[").map_or(list, |(list, _)| list);
    let crates: Vec<&str> = list
        .lines()
        .filter_map(|line| line.split_once(" = "))
        .map(|(name, _)| name)
        .collect();
    assert!(crates.len() > 20, "{crates:?}");
    let notes = read("third_party_notes/crates.md");
    // The first cell may name several, and say when they are used.
    let listed: Vec<&str> = notes
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(" |").next())
        .flat_map(|cell| cell.split([' ', ',', '(']))
        .collect();
    let missing: Vec<_> = crates
        .iter()
        .filter(|name| !name.starts_with("clerestory") && !listed.contains(name))
        .collect();
    assert!(
        missing.is_empty(),
        "third_party_notes/crates.md has no line for {missing:?}"
    );
    let index = read("third_party_notes/README.md");
    for page in std::fs::read_dir(root.join("third_party_notes")).expect("folder") {
        let name = page.expect("entry").file_name().to_string_lossy().into_owned();
        assert!(
            name == "README.md" || index.contains(&format!("]({name})")),
            "{name} is not in the index"
        );
    }
}

#[test]
fn expressions_are_evaluated() {
    let allowed: BTreeSet<String> = ["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"]
        .map(str::to_owned)
        .into();
    for (expression, expected) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("MIT/Apache-2.0", true),
        ("MIT AND GPL-3.0", false),
        ("GPL-3.0 OR MIT AND Zlib", true),
        ("(GPL-3.0 OR MIT) AND BSD-3-Clause", false),
        ("Zlib AND (MIT OR Apache-2.0)", true),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("Apache-2.0", false),
    ] {
        assert_eq!(satisfied(expression, &allowed), Ok(expected), "{expression}");
    }
    for broken in ["", "MIT OR", "(MIT", "MIT Zlib", "AND", "MIT)"] {
        assert!(satisfied(broken, &allowed).is_err(), "{broken:?}");
    }
}
