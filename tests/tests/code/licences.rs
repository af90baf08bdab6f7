//! Every dependency's licence and source is one of those that `deny.toml` allows, and every second version of a crate is one that it lists.
//!
//! Offline: licences by `cargo metadata` of this platform, with the SPDX expressions evaluated here (AND, OR, WITH, parentheses; `/` as the old
//! form of OR). An unknown word, a missing licence or a syntax error fails. Sources and versions by `Cargo.lock`, which has the packages of all
//! platforms and features. The crates used directly have their line in `third_party_notes/crates.md`, and every page of notes is in the index.

use std::collections::{BTreeMap, BTreeSet};
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

fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn table(text: &str) -> toml::Table {
    toml::from_str(text).expect("TOML")
}

fn file(name: &str) -> toml::Table {
    table(&std::fs::read_to_string(root().join(name)).expect(name))
}

/// The tables or strings of a list.
fn list<'a>(table: &'a toml::Table, section: &str, name: &str) -> &'a [toml::Value] {
    let list = table[section].get(name).and_then(toml::Value::as_array);
    list.map(Vec::as_slice).unwrap_or_default()
}

fn strings(list: &[toml::Value]) -> BTreeSet<String> {
    let text = |value: &toml::Value| value.as_str().expect("a string").to_owned();
    list.iter().map(text).collect()
}

/// The strings of the `allow` list of `deny.toml`.
fn allow_list() -> BTreeSet<String> {
    strings(list(&file("deny.toml"), "licenses", "allow"))
}

/// What `cargo metadata` says of the packages for this platform.
fn metadata() -> serde_json::Value {
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
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// A package of a lock file.
struct Package {
    name: String,
    version: String,
    /// Where it is from; `None` for one by its path.
    source: Option<String>,
    has_checksum: bool,
    /// Names, with the version where there are several.
    dependencies: BTreeSet<String>,
}

fn packages(lock: &toml::Table) -> Vec<Package> {
    let text = |package: &toml::Value, key: &str| Some(package.get(key)?.as_str()?.to_owned());
    let package = |package: &toml::Value| Package {
        name: text(package, "name").expect("a name"),
        version: text(package, "version").expect("a version"),
        source: text(package, "source"),
        has_checksum: text(package, "checksum").is_some_and(|sum| sum.len() == 64),
        dependencies: package
            .get("dependencies")
            .and_then(toml::Value::as_array)
            .map(|list| strings(list))
            .unwrap_or_default(),
    };
    lock["package"]
        .as_array()
        .expect("packages")
        .iter()
        .map(package)
        .collect()
}

/// Packages that are neither of the workspace nor, with a checksum, of a registry that is allowed, nor of a repository that is.
fn of_unknown_sources(lock: &toml::Table, deny: &toml::Table, workspace: &BTreeSet<String>) -> Vec<String> {
    let registries = strings(list(deny, "sources", "allow-registry"));
    let repositories = strings(list(deny, "sources", "allow-git"));
    let is_known = |package: &Package| match &package.source {
        None => workspace.contains(&package.name),
        Some(source) => match source.split_once('+') {
            Some(("registry" | "sparse", address)) => registries.contains(address) && package.has_checksum,
            Some(("git", address)) => repositories.contains(address.split(['?', '#']).next().unwrap_or_default()),
            _ => false,
        },
    };
    let unknown = packages(lock).into_iter().filter(|package| !is_known(package));
    unknown
        .map(|package| {
            let source = package.source.as_deref().unwrap_or("a path");
            format!("{} {} from {source}", package.name, package.version)
        })
        .collect()
}

/// Crates with more than one version that is not listed, and entries of the lists that name no second version.
fn duplicates(lock: &toml::Table, deny: &toml::Table) -> Vec<String> {
    let packages = packages(lock);
    let specs = |name: &str| -> BTreeSet<String> {
        let spec = |entry: &toml::Value| entry["crate"].as_str().expect("a crate").to_owned();
        list(deny, "bans", name).iter().map(spec).collect()
    };
    let (skipped, trees) = (specs("skip"), specs("skip-tree"));
    let spec = |package: &Package| format!("{}@{}", package.name, package.version);
    // Versions that only a tree's root asks for.
    let is_of_tree = |package: &Package| {
        let name = format!("{} {}", package.name, package.version);
        let mut users = packages
            .iter()
            .filter(|user| user.dependencies.contains(&name))
            .peekable();
        users.peek().is_some() && users.all(|user| trees.contains(&spec(user)))
    };
    let mut versions: BTreeMap<&str, Vec<&Package>> = BTreeMap::new();
    for package in &packages {
        versions.entry(&package.name).or_default().push(package);
    }
    versions.retain(|_, versions| versions.len() > 1);
    let mut faults = Vec::new();
    for (name, versions) in &versions {
        let left = |package: &&&Package| !skipped.contains(&spec(package)) && !is_of_tree(package);
        let left: Vec<&str> = versions
            .iter()
            .filter(left)
            .map(|package| package.version.as_str())
            .collect();
        if left.len() > 1 {
            faults.push(format!("{name}: {}", left.join(", ")));
        }
    }
    let several: BTreeSet<String> = versions.values().flatten().map(|package| spec(package)).collect();
    faults.extend(
        skipped
            .difference(&several)
            .map(|spec| format!("{spec} is listed in vain")),
    );
    let all: BTreeSet<String> = packages.iter().map(spec).collect();
    faults.extend(trees.difference(&all).map(|spec| format!("{spec} is listed in vain")));
    faults
}

#[test]
fn every_dependency_is_from_a_known_source() {
    let deny = file("deny.toml");
    for rule in ["unknown-registry", "unknown-git"] {
        assert_eq!(deny["sources"][rule].as_str(), Some("deny"), "{rule}");
    }
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("packages");
    let members = metadata["workspace_members"].as_array().expect("members");
    let workspace: BTreeSet<String> = packages
        .iter()
        .filter(|package| members.contains(&package["id"]))
        .filter_map(|package| package["name"].as_str().map(str::to_owned))
        .collect();
    assert!(
        workspace.contains("clerestory") && workspace.len() == members.len(),
        "{workspace:?}"
    );
    let unknown = of_unknown_sources(&file("Cargo.lock"), &deny, &workspace);
    assert!(unknown.is_empty(), "{unknown:#?}");
}

#[test]
fn every_second_version_is_listed() {
    let deny = file("deny.toml");
    assert_eq!(deny["bans"]["multiple-versions"].as_str(), Some("deny"));
    let found = duplicates(&file("Cargo.lock"), &deny);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn foreign_sources_and_unlisted_versions_are_found() {
    const CRATES_IO: &str = "registry+https://github.com/rust-lang/crates.io-index";
    let sum = "0".repeat(64);
    let package = |name: &str, version: &str, source: &str, rest: &str| {
        let source = match source {
            "" => String::new(),
            source => format!("source = \"{source}\"\n"),
        };
        format!("[[package]]\nname = \"{name}\"\nversion = \"{version}\"\n{source}{rest}\n")
    };
    let from_registry = |name: &str, version: &str| package(name, version, CRATES_IO, &format!("checksum = \"{sum}\""));
    let deny = table(
        "[bans]\nskip = [{ crate = \"a@1.0.0\" }]\nskip-tree = [{ crate = \"root@1.0.0\" }]\n\
         [sources]\nallow-registry = [\"https://github.com/rust-lang/crates.io-index\"]\nallow-git = [\"https://host/good\"]\n",
    );
    let workspace = BTreeSet::from(["own".to_owned()]);
    let unknown = |packages: &[String]| of_unknown_sources(&table(&packages.concat()), &deny, &workspace);
    let good = [
        package("own", "0.1.0", "", ""),
        from_registry("a", "1.0.0"),
        package("b", "1.0.0", "git+https://host/good?rev=1#123", ""),
    ];
    assert_eq!(unknown(&good), [""; 0]);
    for (name, source, rest) in [
        ("path", "", String::new()),
        ("no-checksum", CRATES_IO, String::new()),
        (
            "registry",
            "registry+https://host/index",
            format!("checksum = \"{sum}\""),
        ),
        ("git", "git+https://host/bad#123", String::new()),
        ("longer", "git+https://host/good-or-bad#123", String::new()),
        (
            "strange",
            "https://github.com/rust-lang/crates.io-index",
            format!("checksum = \"{sum}\""),
        ),
    ] {
        let found = unknown(&[good.concat(), package(name, "1.0.0", source, &rest)]);
        assert!(found.len() == 1 && found[0].starts_with(name), "{name}: {found:?}");
    }

    let versions = |packages: &[String]| duplicates(&table(&packages.concat()), &deny);
    let root = package("root", "1.0.0", CRATES_IO, "dependencies = [\"c 1.0.0\", \"c 2.0.0\"]");
    let two = [from_registry("a", "1.0.0"), from_registry("a", "2.0.0"), root];
    assert_eq!(versions(&two), [""; 0]);
    let third = [two.concat(), from_registry("a", "3.0.0")];
    assert_eq!(versions(&third), ["a: 2.0.0, 3.0.0"]);
    // Several versions of c are the tree's own, until somebody else asks for one.
    let c = ["1.0.0", "2.0.0", "3.0.0"].map(|version| from_registry("c", version));
    let tree = [two.concat(), c.concat()];
    assert_eq!(versions(&tree), [""; 0]);
    let user = package("user", "1.0.0", CRATES_IO, "dependencies = [\"c 2.0.0\"]");
    assert_eq!(versions(&[tree.concat(), user]), ["c: 2.0.0, 3.0.0"]);
    let in_vain = versions(&[from_registry("a", "1.0.0")]);
    assert_eq!(in_vain, ["a@1.0.0 is listed in vain", "root@1.0.0 is listed in vain"]);
}

#[test]
fn every_dependency_has_an_allowed_licence() {
    let allowed = allow_list();
    assert!(allowed.contains("MIT") && allowed.contains("Apache-2.0"), "{allowed:?}");
    let metadata = metadata();
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
    let root = root();
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
