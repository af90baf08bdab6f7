//! The rows name what is there, and the checks find what is not.

use super::*;
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
        assert!(
            PREFIXES.iter().any(|(prefix, _)| row.id.starts_with(prefix)),
            "{}",
            row.id
        );
        assert!(!row.name.is_empty(), "{}", row.id);
    }
    let ids = ["PM-MAP-9", "PM-MAP-10", "MET-B1", "CL-GGX"].map(order);
    assert!(ids.is_sorted(), "{ids:?}");
}

/// What is wrong with the sentence that says what a row cannot do.
fn fault_of_limits(limits: &str) -> Option<&'static str> {
    let sentence = limits.strip_suffix('.').unwrap_or_default();
    if sentence.split_whitespace().count() < 3 {
        return Some("is not a sentence that ends with a period");
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

/// What is wrong with the command that measures a system beside the experiments.
fn fault_of_command(command: &str) -> Option<String> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let program = match words[..] {
        [] => return None,
        ["clerestory", "report", ..] => return Some("experiments name what they measure in their `systems`".into()),
        // A command is a file or a folder.
        ["clerestory", command, ..] => format!("tools/src/commands/{command}"),
        [program, ..] => program.into(),
    };
    let file = format!("{program}.rs");
    let is_there = repository().join(&program).exists() || repository().join(file).is_file();
    (!is_there).then(|| format!("no program {program}"))
}

/// The ids that the `systems` of all experiments name, each with the experiment.
fn measured() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let folder = std::fs::read_dir(repository().join("tools/experiments")).expect("experiments");
    for file in folder.map(|entry| entry.expect("entry").path()) {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let Some((_, after)) = text.split_once("\nsystems = [") else {
            continue;
        };
        let ids = after.split(']').next().unwrap_or_default();
        let ids = ids
            .split(',')
            .map(|id| id.trim().trim_matches('"'))
            .filter(|id| !id.is_empty());
        found.extend(ids.map(|id| (id.to_owned(), file.display().to_string())));
    }
    found
}

/// Whether a public path of this crate is there: every module on the way is public, and the last declares or re-exports the item.
fn is_public(path: &str) -> bool {
    let mut names: Vec<&str> = path.split("::").collect();
    let item = names.pop().unwrap_or_default();
    let mut modules = names.into_iter();
    if modules.next() != Some("clerestory") {
        return false;
    }
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let mut folder = repository().join("engine/src");
    let mut text = read(&folder.join("lib.rs"));
    for module in modules {
        // Techniques are declared by their names in `methods!`.
        let declarations = [format!("pub mod {module};"), format!("    {module},")];
        if !text.lines().any(|line| declarations.iter().any(|known| line == known)) {
            return false;
        }
        let file = folder.join(format!("{module}.rs"));
        folder.push(module);
        text = read(&if file.is_file() { file } else { folder.join("mod.rs") });
    }
    let names = |text: &str| {
        let mut words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        words.any(|word| word == item)
    };
    let declares = |line: &str| {
        let kinds = ["struct", "enum", "trait", "const fn", "fn", "type", "mod"];
        let rest = kinds.iter().find_map(|kind| line.strip_prefix(&format!("pub {kind} ")));
        rest.is_some_and(|rest| rest.split(|c: char| !(c.is_alphanumeric() || c == '_')).next() == Some(item))
    };
    let mut uses = text.split("\npub use ").skip(1);
    text.lines().any(declares) || uses.any(|text| names(text.split(';').next().unwrap_or_default()))
}

#[test]
fn public_paths_that_are_not_there_are_found_out() {
    for path in [
        "clerestory::kernels::RadixSort",
        "clerestory::plan::plan",
        "clerestory::transport::ggx",
    ] {
        assert!(is_public(path), "{path}");
    }
    for path in [
        "clerestory::kernels::Radix",
        "clerestory::kernels::radix_sort::RadixSort",
        "clerestory::accel::ray_index",
        "kernels::RadixSort",
        "clerestory",
    ] {
        assert!(!is_public(path), "{path}");
    }
}

/// The card of the technique that a row is a part of.
fn technique_of(row: &Row) -> Option<&'static Card> {
    let whole = match row.role {
        Role::PartOf(of) => return technique_of(find(of)?),
        _ => row.id,
    };
    techniques::all()
        .iter()
        .find(|card| row_of(card).is_some_and(|row| row.id == whole))
}

#[test]
fn what_hosts_call_and_set_is_there() {
    let mut faults = Vec::new();
    for row in all() {
        let must_be_called = !matches!(row.role, Role::PartOf(_));
        if must_be_called && row.api.is_empty() {
            faults.push(format!("{}: nothing to call", row.id));
        }
        let is_path = |text: &&&str| text.starts_with("clerestory::");
        let paths = row.api.iter().chain(row.settings.iter().filter(is_path));
        faults.extend(
            paths
                .filter(|path| !is_public(path))
                .map(|path| format!("{}: no public {path}", row.id)),
        );
        // The program's tests read the command lines.
        for name in row.settings.iter().filter(|text| !text.starts_with("clerestory")) {
            if !technique_of(row).is_some_and(|card| card.settings.has(name)) {
                faults.push(format!("{}: no setting {name}", row.id));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Rows of yardsticks over indexes that are called elsewhere: counters and queries of the trees that photon mapping builds.
const YARDSTICKS_ELSEWHERE: [&str; 3] = ["PM-MAP-10", "PM-MAP-7", "PM-X-3"];

#[test]
fn yardsticks_of_indexes_are_called_by_their_own_module_and_nothing_else_is() {
    let mut elsewhere = Vec::new();
    let mut seen = 0;
    for row in all().iter().filter(|row| row.module.starts_with("engine/src/accel/")) {
        let of_them = row
            .api
            .iter()
            .filter(|path| path.starts_with("clerestory::accel::yardstick::"));
        let named = of_them.count();
        if row.role != Role::Yardstick {
            assert_eq!(named, 0, "{} is no yardstick", row.id);
        } else if named == row.api.len() {
            seen += 1;
        } else {
            elsewhere.push(row.id);
        }
    }
    elsewhere.sort_unstable();
    assert_eq!(elsewhere, YARDSTICKS_ELSEWHERE);
    assert!(seen > 5, "{seen}");
}

/// What the engine's code, without its tests, calls of the yardsticks by name, with the files.
fn uses_of_yardsticks() -> Vec<String> {
    let accel = repository().join("engine/src/accel");
    let list = std::fs::read_to_string(accel.join("yardstick.rs")).expect("yardsticks");
    let (mut names, mut homes) = (Vec::new(), Vec::new());
    for used in list.lines().filter_map(|line| line.strip_prefix("pub use super::")) {
        let (module, items) = used.rsplit_once("::").expect("a path");
        homes.push(accel.join(format!("{}.rs", module.replace("::", "/"))));
        let words = items.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        names.extend(words.filter(|word| !word.is_empty()).map(str::to_owned));
    }
    assert!(
        names.len() > 10 && homes.iter().all(|home| home.is_file()),
        "{names:?} of {homes:?}"
    );
    homes.push(accel.join("yardstick.rs"));
    let engine = repository().join("engine/src");
    let mut found = Vec::new();
    for path in rust_files().into_iter().filter(|path| path.starts_with(&engine)) {
        let is_test = path
            .file_stem()
            .is_some_and(|stem| stem.to_string_lossy().ends_with("tests"));
        if is_test || homes.contains(&path) {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("source");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let words = code.flat_map(|line| line.split(|c: char| !(c.is_alphanumeric() || c == '_')));
        let named = words.filter(|word| names.iter().any(|name| name == word));
        found.extend(named.map(|name| format!("{}: {name}", path.display())));
    }
    found
}

#[test]
fn the_engine_does_not_use_its_yardsticks() {
    let found = uses_of_yardsticks();
    assert!(found.is_empty(), "{found:#?}");
}

/// Every kernel of a card is among the shaders, which name files and folders, of its row, of parts, or of what hosts can call alone.
#[test]
fn rows_of_techniques_have_the_kernels_of_their_cards() {
    let mut faults = Vec::new();
    for card in techniques::all() {
        let row = row_of(card).expect("row");
        let beside = all().iter().filter(|row| !matches!(row.role, Role::Technique));
        let shaders: Vec<&str> = beside.chain([row]).flat_map(|row| row.shaders).copied().collect();
        for kernel in card.kernels.concat() {
            let file = format!("shaders/{}", kernel.name);
            let named = |shaders: &&str| {
                if shaders.ends_with('/') {
                    file.starts_with(shaders)
                } else {
                    *shaders == file
                }
            };
            if !shaders.iter().any(named) {
                faults.push(format!("{}: {file}", row.id));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_row_is_measured_and_nothing_else() {
    let measured = measured();
    assert!(measured.len() > 150, "{}", measured.len());
    for (id, experiment) in &measured {
        assert!(find(id).is_some_and(|row| row.id == id), "{experiment}: no row {id}");
    }
    for row in all() {
        assert!(
            !row.experiment.is_empty() || measured.iter().any(|(id, _)| id == row.id),
            "no experiment names {} in its `systems`, and it has no command",
            row.id
        );
    }
}

#[test]
fn modules_tests_and_commands_exist() {
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
        faults.extend(fault_of_command(row.experiment).map(|f| format!("{}: {f}", row.id)));
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
fn commands_that_are_not_there_are_found_out() {
    assert!(fault_of_command("clerestory nothing").is_some());
    assert!(fault_of_command("clerestory report sample-sums").is_some());
    assert!(fault_of_command("tools/nothing").is_some());
    for sound in ["", "clerestory bench --sort", "tools/test"] {
        assert_eq!(fault_of_command(sound), None);
    }
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
