//! Complex indices of refraction of common metals, per RGB band.
//!
//! Values: Johnson and Christy, "Optical Constants of the Noble Metals", Phys. Rev. B 6, 4370 (1972), for gold, silver and copper; Rakić,
//! "Algorithm for the determination of intrinsic optical constants of metal films: application to aluminum", Appl. Opt. 34, 4755
//! (1995), for aluminium; taken at about 630, 532 and 465 nm for red, green and blue. They are interpolated samples at
//! single wavelengths, good to about two digits, not averages over sensitivity curves.

use glam::Vec3;

use super::ConductorIor;

const TABLE: &[(&str, ConductorIor)] = &[
    (
        "gold",
        ConductorIor {
            eta: Vec3::new(0.18, 0.54, 1.33),
            k: Vec3::new(3.43, 2.23, 1.87),
        },
    ),
    (
        "silver",
        ConductorIor {
            eta: Vec3::new(0.057, 0.054, 0.047),
            k: Vec3::new(4.25, 3.43, 2.80),
        },
    ),
    (
        "copper",
        ConductorIor {
            eta: Vec3::new(0.275, 1.08, 1.155),
            k: Vec3::new(3.37, 2.59, 2.47),
        },
    ),
    (
        "aluminium",
        ConductorIor {
            eta: Vec3::new(1.36, 0.94, 0.69),
            k: Vec3::new(7.59, 6.42, 5.64),
        },
    ),
];

/// The names that [`by_name`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(|(name, _)| *name)
}

/// The complex index of refraction of a metal by its name (`aluminum` is understood too).
pub fn by_name(name: &str) -> Option<ConductorIor> {
    let name = if name == "aluminum" { "aluminium" } else { name };
    TABLE.iter().find(|(known, _)| *known == name).map(|(_, ior)| *ior)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal_reflectance(ior: ConductorIor) -> Vec3 {
        let (eta, k) = (ior.eta, ior.k);
        ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k)
    }

    #[test]
    fn normal_reflectances_have_the_colours_of_the_metals() {
        let of = |name| normal_reflectance(by_name(name).expect("metal"));
        let gold = of("gold");
        assert!(gold.x > 0.9 && gold.y > 0.65 && gold.y < 0.85 && gold.z < 0.5, "{gold}");
        let copper = of("copper");
        assert!(copper.x > 0.9 && copper.y < 0.7 && copper.z < 0.65, "{copper}");
        assert!(of("silver").min_element() > 0.95);
        assert!(of("aluminium").min_element() > 0.9);
        assert!(by_name("aluminum").is_some() && by_name("mithril").is_none());
        assert_eq!(names().count(), 4);
    }
}
