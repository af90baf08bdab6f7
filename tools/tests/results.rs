//! The pages of results are those that would be made now of the rows that are kept, so that none is older than its experiment's columns, criteria or
//! plots; and every experiment has one. `clerestory report --pages` makes them anew.

use std::path::{Path, PathBuf};

use clerestory_tools::experiments;
use clerestory_tools::experiments::findings::Plot;
use clerestory_tools::experiments::pages::{self, FOLDER, PAGE, Stored};

type Tested = Result<(), Box<dyn std::error::Error>>;

/// What all results may take together.
const MOST_BYTES: u64 = 40 << 20;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn every_experiment_has_the_page_that_would_be_made_now() -> Tested {
    let mut faults = Vec::new();
    for name in experiments::names() {
        let experiment = experiments::find(name)?;
        let folder = root().join(FOLDER).join(name);
        let stored = match Stored::read(&folder) {
            Ok(stored) => stored,
            Err(error) => {
                faults.push(format!("{name}: {error}"));
                continue;
            }
        };
        match pages::files(&experiment, stored.as_ref()) {
            Ok(files) => {
                let differs = |file: &&pages::File| {
                    std::fs::read_to_string(folder.join(&file.name)).ok().as_deref() != Some(&file.text)
                };
                faults.extend(files.iter().filter(differs).map(|file| format!("{name}/{}", file.name)));
            }
            Err(error) => faults.push(format!("{name}: {error}")),
        }
        let found = pages::findings(&experiment, stored.as_ref())?;
        let pictures = found.plots.iter().filter(|plot| Plot::is_file(plot));
        let missing = pictures.filter(|plot| !folder.join(&plot.file).is_file());
        faults.extend(missing.map(|plot| format!("{name}/{} is not there", plot.file)));
        // A criterion without a verdict cannot be: the page has a line for each that there is before a run.
        let declared = pages::findings(&experiment, None)?;
        let has_none = declared.verdicts.is_empty();
        faults.extend(has_none.then(|| format!("{name} has no criterion")));
        let page = std::fs::read_to_string(folder.join(PAGE)).unwrap_or_default();
        let unsaid = declared.verdicts.iter().filter(|judged| !page.contains(&judged.name));
        faults.extend(unsaid.map(|judged| format!("{name} does not say \"{}\"", judged.name)));
    }
    assert!(
        faults.is_empty(),
        "run `clerestory report --pages`:\n{}",
        faults.join("\n")
    );
    Ok(())
}

#[test]
fn the_list_and_all_quotations_are_of_these_results() -> Tested {
    let written = std::fs::read_to_string(root().join(FOLDER).join(PAGE))?;
    assert_eq!(written, pages::list(&root())?, "run `clerestory report --pages`");
    for (path, old, new) in pages::quotations(&root())? {
        assert_eq!(old, new, "{path}: run `clerestory report --pages`");
    }
    Ok(())
}

#[test]
fn results_are_of_experiments_and_few_bytes() -> Tested {
    let mut bytes = 0;
    for entry in std::fs::read_dir(root().join(FOLDER))? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            let name = entry.file_name().to_string_lossy().into_owned();
            assert!(
                experiments::names().any(|known| known == name),
                "{name} is not an experiment"
            );
            for file in std::fs::read_dir(entry.path())? {
                bytes += file?.metadata()?.len();
            }
        }
    }
    assert!(bytes < MOST_BYTES, "{bytes} bytes");
    Ok(())
}
