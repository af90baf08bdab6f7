//! Where experiments write: a folder for each run, and the repository's results.

use std::path::{Path, PathBuf};

use clerestory::input::read_file;
use clerestory::{Error, Result};
use clerestory_tools::experiments::Experiment;
use clerestory_tools::experiments::pages::{self, File, Page, Stored};

use super::{Arguments, files, folder};
use crate::failure::Outcome;
use crate::output;
use crate::outputs::{self, Inputs, NamedFile, OutputFolder, Outputs, Overwriting, Written};

/// Where pages are: the repository's root.
const ROOT: &str = ".";
/// Most bytes of a picture that is copied.
const MOST_BYTES: u64 = 1 << 28;

/// Where an experiment writes.
pub struct Places {
    /// Everything of this run.
    pub folder: OutputFolder,
    /// What is kept in the repository.
    pub results: Option<KeptResults>,
}

/// An experiment's folder of the repository's results.
pub struct KeptResults(OutputFolder);

/// Checks the folders of all experiments, before the first one runs.
pub fn plan(arguments: &Arguments, found: &[Experiment]) -> Outcome<Vec<Places>> {
    // Files of experiments; a name stands for none.
    let mut inputs = Inputs::of(&arguments.experiments);
    for address in &arguments.scenes {
        inputs.add_address(address);
    }
    let overwriting = arguments.overwriting;
    if arguments.results {
        needs_results()?;
        // All of them are replaced after each experiment.
        plan_results(&pages::summary_paths(Path::new(ROOT)), &inputs, overwriting)?;
    }
    outputs::check_folder(&arguments.references, &inputs)?;
    let plan = |experiment: &Experiment| {
        let folder = folder(arguments, experiment);
        outputs::check_folder(&folder, &inputs)?;
        let results = arguments
            .results
            .then(|| KeptResults::plan(experiment, &inputs, overwriting));
        Ok(Places {
            folder: OutputFolder::plan(&folder, &files::names(&folder), &inputs, overwriting)?,
            results: results.transpose()?,
        })
    };
    found.iter().map(plan).collect()
}

impl KeptResults {
    fn plan(experiment: &Experiment, inputs: &Inputs, overwriting: Overwriting) -> Outcome<Self> {
        let folder = Path::new(ROOT).join(pages::FOLDER).join(&experiment.name);
        let mut names = vec![pages::FOUND.to_owned(), pages::PAGE.to_owned()];
        names.extend(files::numbered_and_drawn(&folder));
        let plan = if pages::are_ours(Path::new(ROOT)) {
            OutputFolder::of_ours(&folder, &names, inputs, overwriting)
        } else {
            OutputFolder::plan(&folder, &names, inputs, overwriting)
        };
        Ok(Self(plan?))
    }

    /// Keeps what was found, with the pictures that the run wrote into a folder of its own.
    pub fn keep(&self, experiment: &Experiment, stored: &Stored, from: &Path) -> Outcome<Written> {
        let texts = pages::of_run(experiment, stored)?.into_iter();
        let mut files: Vec<NamedFile> = texts.map(|File { name, text }| NamedFile::new(name, text)).collect();
        let found = pages::findings(experiment, Some(stored))?;
        for plot in found.plots.iter().filter(|plot| plot.is_file()) {
            match read_file(&from.join(&plot.file), MOST_BYTES) {
                Ok(picture) => files.push(NamedFile::new(plot.file.clone(), picture)),
                Err(cause) => output::warn(&format!("a picture is left out of the results: {cause}")),
            }
        }
        Ok(self.0.write(&files))
    }
}

/// Writes the list of all results, and the pages that quote them.
pub fn write_summaries() -> Outcome {
    let pages = pages::summaries(Path::new(ROOT))?;
    // They were checked before the work began.
    write(&pages, Overwriting { overwrite: true })
}

/// Writes all pages of results anew from what is stored.
pub fn write_all(overwriting: Overwriting) -> Outcome {
    needs_results()?;
    write(&pages::all(Path::new(ROOT))?, overwriting)?;
    output::note(&format!("wrote {}", pages::FOLDER));
    Ok(())
}

fn write(pages: &[Page], overwriting: Overwriting) -> Outcome {
    let paths: Vec<PathBuf> = pages.iter().map(|page| page.path.clone()).collect();
    let plan = plan_results(&paths, &Inputs::default(), overwriting)?;
    let contents: Vec<Vec<u8>> = pages.iter().map(|page| page.text.clone().into_bytes()).collect();
    plan.write(&contents, || None).check()
}

/// Files of a folder of results that this program has not made are somebody's; pages elsewhere quote results where they say so, whoever wrote them.
fn plan_results(paths: &[PathBuf], inputs: &Inputs, overwriting: Overwriting) -> Outcome<Outputs> {
    let results = Path::new(ROOT).join(pages::FOLDER);
    if !pages::are_ours(Path::new(ROOT)) {
        let inside: Vec<&PathBuf> = paths.iter().filter(|path| path.starts_with(&results)).collect();
        Outputs::plan(&inside, inputs, overwriting.overwrite)?;
    }
    Outputs::of_ours(paths, inputs, overwriting.overwrite)
}

/// Pages are made where there are some: the repository's root.
fn needs_results() -> Result<()> {
    if Path::new(pages::FOLDER).is_dir() {
        return Ok(());
    }
    let folder = std::env::current_dir().unwrap_or_default();
    let cause = format!("has no {}/: run this in the repository's root", pages::FOLDER);
    Err(Error::setting("working folder", folder.display().to_string(), cause))
}
