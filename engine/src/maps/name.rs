//! Names of maps, as command lines and reports write them.

use super::Parametrization;
use crate::{Error, Result};
use std::fmt;
use std::str::FromStr;

const PERSPECTIVE: &str = "octahedron-c";

/// Those without a parameter.
const NAMES: [(&str, Parametrization); 8] = [
    ("lat-long", Parametrization::LatLong),
    ("sphere", Parametrization::Sphere),
    ("cube", Parametrization::Cube),
    ("paraboloid", Parametrization::DualParaboloid),
    ("nusselt", Parametrization::Nusselt),
    ("octahedron", Parametrization::OctahedronQuadratic),
    ("octahedron-rectangular", Parametrization::OctahedronRectangular),
    ("equal-area", Parametrization::EqualArea),
];

impl fmt::Display for Parametrization {
    /// As [`FromStr`] reads it: `octahedron`, or `octahedron-c=0.5` for the perspective family.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self, NAMES.iter().find(|(_, map)| map == self)) {
            (_, Some((name, _))) => f.pad(name),
            (Self::OctahedronPerspective { c }, _) => f.pad(&format!("{PERSPECTIVE}={c}")),
            _ => Ok(()),
        }
    }
}

impl FromStr for Parametrization {
    type Err = Error;

    /// # Errors
    /// [`Error::Setting`] for a name that is not known, or for a parameter that is not above 0.
    fn from_str(text: &str) -> Result<Self> {
        if let Some((_, map)) = NAMES.iter().find(|(name, _)| *name == text) {
            return Ok(*map);
        }
        if let Some(parameter) = text.strip_prefix(PERSPECTIVE).and_then(|rest| rest.strip_prefix('=')) {
            return match parameter.parse::<f64>() {
                Ok(c) if c > 0.0 && c.is_finite() => Ok(Self::OctahedronPerspective { c }),
                _ => Err(Error::setting("map", text, "needs a number above 0")),
            };
        }
        let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
        let cause = format!("is not known; there is: {}, {PERSPECTIVE}=NUMBER", names.join(", "));
        Err(Error::setting("map", text, cause))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for map in Parametrization::ALL {
            assert_eq!(map.to_string().parse::<Parametrization>().unwrap(), map);
        }
        for wrong in [
            "",
            "octa",
            "octahedron-c=0",
            "octahedron-c=nan",
            "octahedron-c=inf",
            "octahedron-c",
        ] {
            assert!(wrong.parse::<Parametrization>().is_err(), "{wrong}");
        }
    }
}
