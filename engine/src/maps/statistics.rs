//! How evenly a map spreads its texels over the sphere.

use super::{MapPoint, Parametrization};
use glam::{DVec3, UVec2};

/// Ratios of texels' solid angles to the mean one: above 1 a texel is too coarse. Texels on the rim of a disc count by the part within.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DensityStatistics {
    /// The finest texel.
    pub min_ratio: f64,
    /// The coarsest.
    pub max_ratio: f64,
    /// Root of the mean square of (ratio − 1), by area.
    pub rms: f64,
    /// Greatest ratio of the axes of the ellipse that a small square is on the sphere, at centres of texels.
    pub anisotropy: f64,
    /// Share of the texels' area that holds directions, as the texels sum it.
    pub coverage: f64,
    /// Sum of the texels' solid angles, sr.
    pub solid_angle: f64,
}

/// Ratio of the axes of the ellipse that two derivatives span; infinite where it is flat.
pub fn anisotropy([a, b]: [DVec3; 2]) -> f64 {
    // Squared axes are the eigenvalues of the first fundamental form.
    let (e, f, g) = (a.length_squared(), a.dot(b), b.length_squared());
    let (mean, spread) = (0.5 * (e + g), (0.25 * (e - g) * (e - g) + f * f).sqrt());
    let area = a.cross(b).length();
    (mean + spread) / area
}

impl Parametrization {
    /// Density at a place over the mean density of what the map holds: above 1 it is too coarse there.
    pub fn density_ratio(self, at: MapPoint) -> f64 {
        let mean = self.solid_angle() / (f64::from(self.layers()) * self.coverage());
        self.solid_angle_density(at.uv) / mean
    }

    /// Derivatives of the direction by the two coordinates in texels.
    pub fn texel_derivatives(self, size: UVec2, at: MapPoint) -> [DVec3; 2] {
        let [along, down] = self.derivatives(at);
        [along / f64::from(size.x), down / f64::from(size.y)]
    }

    /// Statistics over the texels of a map, by their exact solid angles.
    pub fn density_statistics(self, size: UVec2) -> DensityStatistics {
        let texels = size.as_dvec2().element_product() * f64::from(self.layers());
        let mean = self.solid_angle() / (texels * self.coverage());
        let mut found = DensityStatistics {
            min_ratio: f64::INFINITY,
            max_ratio: 0.0,
            rms: 0.0,
            anisotropy: 1.0,
            coverage: 0.0,
            solid_angle: 0.0,
        };
        for texel in self.texels(size) {
            let [lower, upper] = texel.bounds(size);
            let covered = self.rectangle_coverage(lower, upper);
            if covered <= 0.0 {
                continue;
            }
            let solid_angle = self.rectangle_solid_angle(lower, upper);
            let ratio = solid_angle / (covered * mean);
            found.min_ratio = found.min_ratio.min(ratio);
            found.max_ratio = found.max_ratio.max(ratio);
            found.rms += covered * (ratio - 1.0) * (ratio - 1.0);
            found.coverage += covered;
            found.solid_angle += solid_angle;
            let centre = texel.centre(size);
            if self.holds(centre) {
                found.anisotropy = found.anisotropy.max(anisotropy(self.texel_derivatives(size, centre)));
            }
        }
        found.rms = (found.rms / found.coverage).sqrt();
        found.coverage /= texels;
        found
    }
}
