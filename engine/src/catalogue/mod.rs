//! The catalogue: the rows of all modules, so that a reader finds where a publication lives in the code.
//!
//! A row ([`Row`], which lower floors use as they do errors) stands beside its module; those of techniques come with their [`Card`], the others by the list in `modules.rs`.
//! [`PREFIXES`] says which publication the ids of each prefix follow; where two of them describe one thing, their rows point at one
//! implementation. Guarantee: the tests below check that the module, shaders, every test and every public path of a row exist, that
//! something measures it, and that rows and sources are sound. `clerestory list` shows the rows and writes `docs/catalogue.md`.

mod modules;
pub(crate) mod row;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use crate::techniques::{self, Card};
pub(crate) use row::Bias;
pub use row::{Cite, Role, Row, Source, sources};

/// Prefixes of ids, in the order of the catalogue, each with what its ids follow.
pub const PREFIXES: [(&str, &str); 7] = [
    (
        "BG-",
        "background (transport, path tracing, photon mapping, shadow maps, ray indexes) of T. Engelhardt's thesis on visibility from a point, 2013",
    ),
    (
        "DP-",
        "directional parametrizations of the same thesis: maps of the sphere",
    ),
    (
        "OEM-",
        "octahedron environment maps of the same thesis, and how they are drawn and looked up",
    ),
    (
        "PM-",
        "B. Fabianowski's thesis \"Interactive Manycore Photon Mapping\", 2011: PM-B parallel building blocks, PM-CA caches of kd-trees, \
         PM-DE density estimation, PM-F foundations, PM-I intersections, PM-KD kd-trees, PM-MAP photon maps, PM-PD photon differentials, \
         PM-PH photons, PM-ST stages, PM-SYS the whole, PM-TR traversal, PM-VOL media, PM-X execution",
    ),
    (
        "MET-",
        "a doctoral thesis on metals and reflections on graphics hardware: MET-B basics of scattering, MET-D distance impostors, \
         MET-E baselines of reflections, MET-F Fresnel terms, MET-G gathers of the light of nearby walls, MET-P previous work, MET-V virtual lights",
    ),
    (
        "SVO-",
        "C. Sun's thesis \"Many-Light Real-Time Global Illumination using Sparse Voxel Octree\", 2015: SVO-G methods that it surveys",
    ),
    ("CL-", "the engine's own, and methods published elsewhere"),
];

/// All rows, ordered by document and id.
pub fn all() -> &'static [Row] {
    static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
        let of_techniques = techniques::all().iter().flat_map(|card| card.rows);
        let rows = of_techniques.chain(modules::MODULES).copied().flatten();
        let mut rows: Vec<Row> = rows.copied().collect();
        rows.sort_by_cached_key(|row| order(row.id));
        rows
    });
    &ROWS
}

/// The row of that id, in letters of either case.
pub fn find(id: &str) -> Option<&'static Row> {
    all().iter().find(|row| row.id.eq_ignore_ascii_case(id))
}

/// A technique's own row, which says where it was published, what it cannot do, and where its tests are; `None` for a host's card without one.
pub fn row_of(card: &Card) -> Option<&'static Row> {
    let mut rows = card.rows.iter().copied().flatten();
    rows.find(|row| row.role == Role::Technique)
}

/// The rows that are part of that row, in the order of the catalogue.
pub fn parts_of(id: &str) -> impl Iterator<Item = &'static Row> {
    all()
        .iter()
        .filter(move |row| matches!(row.role, Role::PartOf(of) if of == id))
}

/// What sources have a part in: each with the rows that cite it and the places in it, ordered by key.
pub fn citations() -> Vec<(Source, Vec<(&'static str, &'static str)>)> {
    let mut found: BTreeMap<&str, (Source, Vec<_>)> = BTreeMap::new();
    for row in all() {
        for cite in row.sources {
            let entry = found.entry(cite.source.key).or_insert((cite.source, Vec::new()));
            entry.1.push((row.id, cite.place));
        }
    }
    found.into_values().collect()
}

/// Where an id stands: by its prefix, then by its words and numbers, so that `PM-MAP-10` comes after `PM-MAP-9`.
fn order(id: &str) -> (usize, Vec<(u64, String)>) {
    let prefix = PREFIXES.iter().position(|(prefix, _)| id.starts_with(prefix));
    let mut parts: Vec<(u64, String)> = Vec::new();
    for c in id.chars() {
        match (c.to_digit(10), parts.last_mut()) {
            (Some(digit), Some((number, text))) if text.is_empty() => {
                *number = number.saturating_mul(10).saturating_add(digit.into());
            }
            (Some(digit), _) => parts.push((digit.into(), String::new())),
            (None, Some((_, text))) if !text.is_empty() => text.push(c),
            (None, _) => parts.push((0, c.into())),
        }
    }
    (prefix.unwrap_or(PREFIXES.len()), parts)
}
