//! Wavefront MTL: the materials of OBJ files, as far as they are modelled: Lambert with Kd, emitting Ke.
//!
//! Own code rather than the crate that reads the OBJ, because that crate panics where a number is expected and none stands. Everything
//! else that a material says is kept by its key, so that it can be reported.

use std::collections::BTreeSet;

use glam::Vec3;

/// One material of a library.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LibraryMaterial {
    pub name: String,
    /// Kd.
    pub diffuse: Option<Vec3>,
    /// Ke.
    pub emission: Option<Vec3>,
    /// Keys that say something which is not modelled.
    pub others: BTreeSet<String>,
}

/// Reads a library.
///
/// # Errors
/// The line of the first fault and what is wrong: a number that is none, a material without a name, a key before the first material.
pub(super) fn parse(text: &str) -> Result<Vec<LibraryMaterial>, String> {
    let mut materials: Vec<LibraryMaterial> = Vec::new();
    // Some editors begin a file with a mark of its encoding.
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    for (i, line) in text.lines().enumerate() {
        let fault = |cause: &str| format!("line {}: {cause}", i + 1);
        let line = line.trim();
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let value = value.trim();
        if key.is_empty() || key.starts_with('#') {
            continue;
        }
        if key == "newmtl" {
            if value.is_empty() {
                return Err(fault("a material without a name"));
            }
            materials.push(LibraryMaterial {
                name: value.into(),
                diffuse: None,
                emission: None,
                others: BTreeSet::new(),
            });
            continue;
        }
        let Some(material) = materials.last_mut() else {
            return Err(fault("stands before the first newmtl"));
        };
        let color = || color(value).ok_or_else(|| fault(&format!("{key} needs one number or three")));
        match key {
            "Kd" => material.diffuse = Some(color()?),
            "Ke" => material.emission = Some(color()?),
            // Ambient light and exponents have no meaning here; the rest is worth a word unless it says nothing.
            "Ka" | "Ns" | "Ni" | "illum" => {}
            "Ks" if color()? == Vec3::ZERO => {}
            "d" if value == "1" || value.parse() == Ok(1.0f32) => {}
            "Tr" if value.parse() == Ok(0.0f32) => {}
            _ => {
                material.others.insert(key.into());
            }
        }
    }
    Ok(materials)
}

/// Three numbers, or one for all channels.
fn color(value: &str) -> Option<Vec3> {
    let numbers: Option<Vec<f32>> = value.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    match numbers?.as_slice() {
        [gray] => Some(Vec3::splat(*gray)),
        [r, g, b, ..] => Some(Vec3::new(*r, *g, *b)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_are_read_and_the_rest_is_kept_by_its_key() {
        let text =
            "# c\n\nnewmtl a b\nKd 0.5\nKs 0 0 0\nd 1.0\nNs 9\n\tKe 1 2 3\nnewmtl c\nmap_Kd x y.png\nd 0.5\nKs 1 1 1\n";
        let materials = parse(text).expect("materials");
        assert_eq!(
            (materials[0].name.as_str(), materials[0].diffuse),
            ("a b", Some(Vec3::splat(0.5)))
        );
        assert_eq!(materials[0].emission, Some(Vec3::new(1.0, 2.0, 3.0)));
        assert!(materials[0].others.is_empty(), "{:?}", materials[0].others);
        assert_eq!(
            materials[1].others.iter().map(String::as_str).collect::<Vec<_>>(),
            ["Ks", "d", "map_Kd"]
        );
        assert_eq!(materials[1].diffuse, None);
    }

    #[test]
    fn faults_have_their_line() {
        for (text, expected) in [
            ("newmtl\n", "line 1: a material without a name"),
            ("newmtl a\nKd 1 x 1\n", "line 2: Kd"),
            ("newmtl a\nKe 1 2\n", "line 2: Ke"),
            ("Kd 1 1 1\n", "line 1: stands before"),
        ] {
            assert!(parse(text).expect_err("fault").starts_with(expected), "{text}");
        }
    }
}
