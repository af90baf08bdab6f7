//! Generated test scenes, addressed as `builtin:cornell-box?key=value&key=value`.
//!
//! Each scene is a pure function of its parameters: the same address gives the same bits on every machine with IEEE 754 arithmetic and
//! the same mathematics library. Every scene has a camera named `main` and a `defaults.aspect`.

mod atrium;
mod cathedral;
mod city;
mod conference;
mod cornell;
mod corner_lamp;
mod fireballs;
mod fog;
mod forest;
mod furnace;
mod game_room;
mod halls;
mod lamp_hall;
mod materials;
mod media;
pub mod noise;
mod parameters;
mod ring;
mod rooms;
mod shaded_lamp;
mod shapes;
mod slab;
mod soup;
mod sphere_flake;
mod surfaces;
mod textures;
mod unit_box;
mod volumes;

pub use parameters::{Parameter, ParameterKind};

use crate::catalogue::{Role, Row, sources};
use crate::scene::Scene;
use crate::{Error, Result};
use parameters::Values;

/// How addresses of generated scenes begin.
pub const PREFIX: &str = "builtin:";

/// A generated scene: its name, what it shows and what can be set.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Entry {
    /// The name after `builtin:`.
    pub name: &'static str,
    /// What it shows, as one sentence.
    pub summary: &'static str,
    /// What can be set.
    pub parameters: &'static [Parameter],
    #[serde(skip)]
    build: fn(&Values) -> Result<Scene>,
}

/// All generated scenes, by name.
pub fn catalogue() -> &'static [Entry] {
    &[
        atrium::ATRIUM,
        city::BOX_CITY,
        rooms::BOX_ROOM,
        cathedral::CATHEDRAL,
        volumes::CLOUD,
        conference::CONFERENCE,
        cornell::CORNELL_BOX,
        corner_lamp::CORNER_LAMP,
        rooms::DIVIDER_ROOM,
        fireballs::FIREBALLS,
        fog::FOG_BOX,
        forest::FOREST,
        furnace::FURNACE_BOX,
        media::FURNACE_MEDIUM,
        furnace::FURNACE_SPHERE,
        game_room::GAME_ROOM,
        lamp_hall::LAMP_HALL,
        materials::MATERIALS,
        media::MEDIUM_SLAB,
        rooms::PASSAGE,
        fog::POINT_IN_FOG,
        ring::RING,
        shaded_lamp::SHADED_LAMP,
        slab::SLAB,
        volumes::SMOKE,
        sphere_flake::SPHERE_FLAKE,
        furnace::SPHERE_LIGHT,
        soup::TRIANGLE_SOUP,
        unit_box::UNIT_BOX,
        media::WAX,
        furnace::WHITE_FURNACE,
    ]
}

/// The generated scene whose name is this one, or almost: up to two letters too many, too few or other ones.
pub(super) fn nearest(name: &str) -> Option<&'static str> {
    const MISTAKES: usize = 2;
    let names = catalogue().iter().map(|entry| (distance(name, entry.name), entry.name));
    let (mistakes, nearest) = names.min()?;
    (mistakes <= MISTAKES).then_some(nearest)
}

/// Levenshtein's distance: how many letters to add, leave out or change.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, other) in b.iter().enumerate() {
            let changed = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// Generates the scene of a `builtin:` address.
///
/// # Errors
/// [`Error::Scene`] for an unknown scene or key, or a value outside its range; it says what is allowed.
pub fn generate(address: &str) -> Result<Scene> {
    let rest = address.strip_prefix(PREFIX).unwrap_or(address);
    let (name, query) = rest.split_once('?').unwrap_or((rest, ""));
    let Some(entry) = catalogue().iter().find(|entry| entry.name == name) else {
        let known: Vec<&str> = catalogue().iter().map(|entry| entry.name).collect();
        let known = format!("there are: {}", known.join(", "));
        return Err(match nearest(name) {
            _ if name.is_empty() => Error::scene(address, "without a name", known),
            Some(near) => Error::scene(
                address,
                format!("name {name:?}"),
                format!("no such generated scene; did you mean {PREFIX}{near}? {known}"),
            ),
            None => Error::scene(
                address,
                format!("name {name:?}"),
                format!("no such generated scene; {known}"),
            ),
        });
    };
    let values = Values::parse(address, query, entry.parameters)?;
    let mut scene = (entry.build)(&values)?;
    scene.name = entry.name.into();
    scene.source = address.into();
    scene.check()?;
    Ok(scene)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-CORNELL",
    name: "Cornell box and the other generated scenes",
    role: Role::Service,
    limits: "Gives the same bits only with the same mathematics library; the Cornell box has colours in common use, not its measured spectra.",
    sources: &[
        sources::GORAL_1984.whole(),
        sources::CORNELL_BOX_DATA.whole(),
        sources::HAINES_1987.whole(),
    ],
    tests: &[
        "engine/src/scene/builtin/cornell.rs::the_areas_are_those_of_the_published_data",
        "engine/src/scene/builtin/mod.rs::every_entry_builds_with_its_defaults_and_has_what_it_promises",
    ],
    experiment: "clerestory agreement",
    api: &["clerestory::scene::builtin::generate"],
    settings: &["clerestory scenes"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneProfile;

    fn message(address: &str) -> String {
        generate(address).expect_err("must be refused").to_string()
    }

    #[test]
    fn stand_ins_have_about_as_many_triangles_as_the_models_they_stand_in_for() {
        let models = [
            ("atrium", 66_454.0),
            ("cathedral", 80_131.0),
            ("conference", 282_801.0),
            ("forest", 174_117.0),
        ];
        for (name, triangles) in models {
            let scene = generate(&format!("{PREFIX}{name}")).expect(name);
            let found = SceneProfile::of(&scene).triangles as f64;
            assert!((found / triangles - 1.0).abs() < 0.05, "{name}: {found}");
        }
    }

    #[test]
    fn every_entry_builds_with_its_defaults_and_has_what_it_promises() {
        for entry in catalogue() {
            let scene = generate(&format!("{PREFIX}{}", entry.name)).expect(entry.name);
            assert_eq!(scene.cameras[0].name, "main", "{}", entry.name);
            assert!(scene.defaults.aspect.is_some_and(|a| a > 0.0));
            assert!(scene.notes.is_empty());
            let profile = SceneProfile::of(&scene);
            let lit = profile.has_area_lights()
                || profile.has_environment()
                || profile.lights.point + profile.lights.spot + profile.lights.directional > 0;
            assert!(lit && profile.triangles > 0, "{}", entry.name);
            assert!(entry.summary.ends_with('.'));
            assert_eq!(profile, SceneProfile::of(&generate(&scene.source).expect("again")));
        }
        let names: Vec<&str> = catalogue().iter().map(|e| e.name).collect();
        assert!(names.is_sorted());
    }

    #[test]
    fn every_bound_and_word_of_every_parameter_is_accepted() {
        for entry in catalogue() {
            for parameter in entry.parameters {
                let values: Vec<String> = match parameter.range {
                    ParameterKind::Real { min, max } | ParameterKind::Color { min, max } => {
                        vec![min.to_string(), max.to_string()]
                    }
                    // Greatest counts make millions of triangles; the least will do.
                    ParameterKind::Integer { min, .. } => vec![min.to_string()],
                    ParameterKind::Choice { words } => words.iter().map(|w| w.to_string()).collect(),
                };
                for value in values {
                    let address = format!("{PREFIX}{}?{}={value}", entry.name, parameter.name);
                    generate(&address).unwrap_or_else(|error| panic!("{error}"));
                }
            }
        }
    }

    #[test]
    fn mistakes_are_answered_with_what_is_allowed() {
        assert!(message("builtin:nothing").contains("cornell-box"));
        assert!(!message("builtin:nothing").contains("did you mean"));
        assert!(message("builtin:cornel-box?light=2").contains("did you mean builtin:cornell-box?"));
        assert!(message("builtin:").starts_with("builtin:: without a name: there are"));
        assert_eq!(
            (distance("kitten", "sitting"), distance("", "ab"), distance("a", "a")),
            (3, 2, 0)
        );
        assert!(message("builtin:cornell-box?lihgt=1").contains("unknown; allowed: light"));
        assert!(message("builtin:cornell-box?light=1&light=2").contains("given twice"));
        assert!(message("builtin:cornell-box?light").contains("key=value"));
        assert!(message("builtin:cornell-box?boxes=three").contains("both | short | tall | none"));
        assert!(message("builtin:furnace-sphere?rho=1.5").contains("0 … 1"));
        assert!(message("builtin:furnace-sphere?rho=NaN").contains("0 … 1"));
        assert!(message("builtin:furnace-sphere?rho=1,1").contains("r,g,b"));
        assert!(message("builtin:triangle-soup?n=1e3").contains("whole"));
    }

    #[test]
    fn profiles_say_what_is_there() {
        let of = |address: &str| SceneProfile::of(&generate(address).expect("scene"));
        let cornell = of("builtin:cornell-box");
        assert_eq!(
            (cornell.triangles, cornell.emissive_triangles, cornell.instances),
            (38, 2, 6)
        );
        assert!(!cornell.has_textures && !cornell.has_metal && !cornell.has_rough_dielectric_spec);
        assert!(!cornell.has_environment() && !cornell.has_transmission() && !cornell.has_alpha());
        assert_eq!(cornell.roughness, None);
        let glass = of("builtin:cornell-box?sphere=glass");
        assert!(glass.transmission.solid && !glass.transmission.thin && glass.has_rough_dielectric_spec);
        let gold = of("builtin:cornell-box?sphere=gold");
        assert!(gold.has_metal && gold.has_conductor && gold.roughness == Some([0.2, 0.2]));
        let furnace = of("builtin:furnace-box");
        assert_eq!((furnace.triangles, furnace.emissive_triangles), (12, 12));
        assert_eq!(furnace.bounds, Some([[-1.0; 3], [1.0; 3]]));
        let white = of("builtin:white-furnace?ior=1");
        assert!(!white.has_rough_dielectric_spec && white.has_environment());
        assert!(of("builtin:slab?attenuation_color=0.5").has_absorption && !of("builtin:slab").has_absorption);
        assert!(of("builtin:divider-room").has_textures);
        assert_eq!(of("builtin:ring").lights.point, 1);
        let text = cornell.to_string();
        assert!(text.contains("38 triangles") && text.contains("diffuse only"), "{text}");
    }
}
