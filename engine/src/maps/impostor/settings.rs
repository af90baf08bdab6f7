//! How a ray is followed through an impostor.

use std::fmt;

use crate::gpu::shaders::constants::{
    IMPOSTOR_CLASSICAL, IMPOSTOR_FALSE_POSITION, IMPOSTOR_FIXED_POINT, IMPOSTOR_HYBRID, IMPOSTOR_MARCH, IMPOSTOR_MIXED,
    IMPOSTOR_PERPENDICULAR, IMPOSTOR_SECANT_FROM_GUESS, IMPOSTOR_SECANT_FROM_POINT,
};
use crate::{Error, Result};

/// Which guesses a search joins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SearchMethod {
    /// None: the ray's own direction, as if all were infinitely far.
    Classical,
    /// p, where the surface would be were it perpendicular to the ray: d = D(r) − r·x. No steps.
    Perpendicular,
    /// Where the ray leaves the sphere about the map's place through the surface of the last guess.
    FixedPoint,
    /// The last two guesses, from x on. Diverges in corners.
    SecantFromPoint,
    /// The last two guesses, from p on. With no steps: the parallax-corrected single look-up.
    SecantFromGuess,
    /// The last guess in front of the surface and the last behind it, from x on, which counts as in front.
    FalsePosition,
    /// The same from p on.
    Mixed,
    /// False position where the map's place sees x, g(0) ≤ 1; mixed elsewhere, where x is no bracket.
    #[default]
    Hybrid,
    /// Even steps to the first crossing, then bisection of it; where its residual is not below the tolerance, a jump at a silhouette, on to the next. The
    /// first hit where the map's place sees it; where it is hidden, a later surface.
    March,
}

impl SearchMethod {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Classical,
        Self::Perpendicular,
        Self::FixedPoint,
        Self::SecantFromPoint,
        Self::SecantFromGuess,
        Self::FalsePosition,
        Self::Mixed,
        Self::Hybrid,
        Self::March,
    ];

    /// The number by which the kernel knows it, its specialization constant `IMPOSTOR_METHOD`.
    pub fn number(self) -> u32 {
        match self {
            Self::Classical => IMPOSTOR_CLASSICAL,
            Self::Perpendicular => IMPOSTOR_PERPENDICULAR,
            Self::FixedPoint => IMPOSTOR_FIXED_POINT,
            Self::SecantFromPoint => IMPOSTOR_SECANT_FROM_POINT,
            Self::SecantFromGuess => IMPOSTOR_SECANT_FROM_GUESS,
            Self::FalsePosition => IMPOSTOR_FALSE_POSITION,
            Self::Mixed => IMPOSTOR_MIXED,
            Self::Hybrid => IMPOSTOR_HYBRID,
            Self::March => IMPOSTOR_MARCH,
        }
    }
}

impl fmt::Display for SearchMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Classical => "classical",
            Self::Perpendicular => "perpendicular",
            Self::FixedPoint => "fixed point",
            Self::SecantFromPoint => "secant from x",
            Self::SecantFromGuess => "secant from p",
            Self::FalsePosition => "false position",
            Self::Mixed => "mixed",
            Self::Hybrid => "hybrid",
            Self::March => "march",
        })
    }
}

/// What a texel holds on the device; of a map without normals the distance alone, whatever is said. Searches find the same in planes and normals, but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpostorTexels {
    /// The texel's plane, sixteen bytes, which look-ups take as it is.
    #[default]
    Planes,
    /// Distance and normal, eight bytes, of which each look-up makes the plane.
    Normals,
    /// The distance of the texel's middle, four bytes, which look-ups take for all of it: searches are off by up to half a texel.
    Distances,
}

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpostorSettings {
    /// Which guesses are joined.
    pub method: SearchMethod,
    /// Steps after the first guess, 0 to 256; intervals of a march, at least 1. One look-up each.
    pub steps: u32,
    /// Halvings of the interval that holds a crossing of a march, 0 to 24.
    pub bisections: u32,
    /// Residual |1 − g| below which a crossing is one of a surface and not a jump at a silhouette, above 0 and below 1. Close to 1, a march ends at the first
    /// crossing, be it a jump.
    pub tolerance: f32,
}

impl Default for ImpostorSettings {
    fn default() -> Self {
        Self {
            method: SearchMethod::Hybrid,
            steps: 3,
            bisections: 12,
            tolerance: 0.02,
        }
    }
}

/// Greatest [`ImpostorSettings::steps`].
pub const MAX_STEPS: u32 = 256;
/// Greatest [`ImpostorSettings::bisections`]: those that f32 tells apart.
pub const MAX_BISECTIONS: u32 = 24;
/// Turns of all loops of a search at most; software drivers end loops after 65,535 over a group.
const MAX_TURNS: u32 = 1 << 15;

impl ImpostorSettings {
    /// A method with so many steps, all else as by default.
    pub fn of(method: SearchMethod, steps: u32) -> Self {
        Self {
            method,
            steps,
            ..Self::default()
        }
    }

    /// Refuses what a search of so many layers cannot have.
    ///
    /// # Errors
    /// [`Error::Setting`] for numbers out of range; [`Error::LimitExceeded`] for a march whose loops could turn more than 2¹⁵ times.
    pub fn check(&self, layers: u32) -> Result<()> {
        let least = u32::from(self.method == SearchMethod::March);
        if !(least..=MAX_STEPS).contains(&self.steps) {
            let cause = format!("is not in {least}..={MAX_STEPS}");
            return Err(Error::setting("impostor steps", self.steps, cause));
        }
        if self.bisections > MAX_BISECTIONS {
            let cause = format!("is not in 0..={MAX_BISECTIONS}");
            return Err(Error::setting("impostor bisections", self.bisections, cause));
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err(Error::setting(
                "impostor tolerance",
                self.tolerance,
                "is not above 0 and below 1",
            ));
        }
        let inner = if self.method == SearchMethod::March {
            self.bisections
        } else {
            0
        };
        let turns = layers * (1 + self.steps * (1 + inner));
        if turns > MAX_TURNS {
            return Err(Error::LimitExceeded {
                name: "impostor search".into(),
                value: turns.into(),
                limit_name: "turns of its loops",
                limit: MAX_TURNS.into(),
            });
        }
        Ok(())
    }
}
