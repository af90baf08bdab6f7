//! Views blended by their depths: what a ray meets, by what several places see and how far away it is.
//!
//! Sources: P. Debevec, Y. Yu, G. Borshukov, "Efficient View-Dependent Image-Based Rendering with Projective Texture-Mapping", EGRW 1998 (views on known surfaces, blended by the angle to them); C. Buehler, M. Bosse, L. McMillan,
//! S. Gortler, M. Cohen, "Unstructured Lumigraph Rendering", SIGGRAPH 2001 (weights that are infinite for the view whose own ray it is).
//!
//! Each view is a map of radiance and distance ([`ImpostorImage`]). The ray is searched for in each; of what is found the nearest counts, since each is a surface that some view sees, and the views that have it there are
//! blended, by one over the angle at which their ray meets the other one. Where no view finds a surface, the one whose search ends nearest to one is taken.
//!
//! Bias: what no view sees is not there, radiance is that towards the views. Sums in the order of views. Deterministic. A yardstick for maps with several layers.

use glam::DVec3;

use super::{ImpostorImage, ImpostorRay, ImpostorSettings};
use crate::catalogue::{Bias, Role, Row, Source};
use crate::gpu::shaders::constants::MAP_PLACES_MAX;
use crate::maps::MapImage;
use crate::{Error, Result};

/// Angles below which a view's ray counts as the ray itself, radians.
const ANGLE_LEAST: f64 = 1e-6;

/// What a place sees.
#[derive(Debug, Clone)]
pub struct DepthView {
    /// Where it is seen from, metres.
    pub place: DVec3,
    /// How far away things are, in one layer or in several.
    pub distances: ImpostorImage,
    /// Radiance of the first layer, from the same directions.
    pub radiance: MapImage,
}

/// Views of one scene.
#[derive(Debug, Clone)]
pub struct BlendedViews {
    views: Vec<DepthView>,
    settings: ImpostorSettings,
}

/// What views show of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blend {
    /// Blended radiance.
    pub radiance: DVec3,
    /// How far away what they show is, metres; [`ImpostorImage::NOTHING`] in the sky.
    pub distance: f64,
    /// How many views show it; 0 where none found a surface.
    pub views: u32,
}

impl BlendedViews {
    /// Of several views, whose searches have these settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for no views or more than 16, for places that are not finite, and for settings out of range.
    pub fn new(views: Vec<DepthView>, settings: ImpostorSettings) -> Result<Self> {
        if !(1..=MAP_PLACES_MAX as usize).contains(&views.len()) {
            return Err(Error::setting(
                "views",
                views.len(),
                format!("are not 1 to {MAP_PLACES_MAX}"),
            ));
        }
        for view in &views {
            if !view.place.is_finite() {
                return Err(Error::setting("place of a view", view.place, "is not finite"));
            }
            settings.check(view.distances.layers())?;
        }
        Ok(Self { views, settings })
    }

    /// What a ray meets, which begins at a place in the views' axes, metres.
    pub fn look_up(&self, ray: &ImpostorRay) -> Blend {
        let found: Vec<_> = self
            .views
            .iter()
            .map(|view| {
                let own = ImpostorRay {
                    origin: ray.origin - view.place,
                    ..*ray
                };
                let hit = view.distances.search(&own, &self.settings);
                // Radiance is the first layer's.
                let is_found =
                    hit.residual < f64::from(self.settings.tolerance) && hit.layer == 0 && hit.distance > 0.0;
                (view, hit, is_found)
            })
            .collect();
        let nearest = found
            .iter()
            .filter(|(_, _, is_found)| *is_found)
            .fold(f64::INFINITY, |nearest, (_, hit, _)| nearest.min(hit.distance));
        let point = ray.origin + nearest * ray.direction;
        let (mut sum, mut weights, mut views) = (DVec3::ZERO, 0.0, 0);
        for (view, hit, is_found) in &found {
            if !is_found || hit.distance > nearest * (1.0 + f64::from(self.settings.tolerance)) {
                continue;
            }
            let along = point - view.place;
            let angle = along.cross(ray.direction).length().atan2(along.dot(ray.direction));
            let weight = 1.0 / angle.max(ANGLE_LEAST);
            sum += weight * view.radiance.look_up(hit.direction).unwrap_or(DVec3::ZERO);
            weights += weight;
            views += 1;
        }
        if views > 0 {
            return Blend {
                radiance: sum / weights,
                distance: nearest,
                views,
            };
        }
        let least = found.iter().min_by(|a, b| a.1.residual.total_cmp(&b.1.residual));
        least.map_or(
            Blend {
                radiance: DVec3::ZERO,
                distance: f64::from(ImpostorImage::NOTHING),
                views,
            },
            |(view, hit, _)| Blend {
                radiance: view.radiance.look_up(hit.direction).unwrap_or(DVec3::ZERO),
                distance: hit.distance,
                views,
            },
        )
    }
}

const DEBEVEC_1998: Source = Source {
    key: "debevec-1998-views",
    authors: "P. Debevec, Y. Yu, G. Borshukov",
    title: "Efficient View-Dependent Image-Based Rendering with Projective Texture-Mapping",
    venue: "EGRW",
    year: 1998,
};
const BUEHLER_2001: Source = Source {
    key: "buehler-2001",
    authors: "C. Buehler, M. Bosse, L. McMillan, S. Gortler, M. Cohen",
    title: "Unstructured Lumigraph Rendering",
    venue: "SIGGRAPH",
    year: 2001,
};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P6",
    name: "views blended by their depths",
    role: Role::Yardstick,
    limits: "Sixteen views; a search in each for every ray, and what no view sees is not there.",
    sources: &[DEBEVEC_1998.whole(), BUEHLER_2001.whole()],
    bias: Some(Bias::Biased(
        "what no view sees is not there, radiance is that towards the views",
    )),
    tests: &[
        "engine/src/maps/impostor/views.rs::further_views_show_what_the_first_does_not",
        "engine/src/maps/impostor/views.rs::a_views_own_rays_are_its_own",
        "engine/src/maps/impostor/views.rs::views_that_are_none_are_refused",
    ],
    api: &["clerestory::maps::impostor::views::BlendedViews"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::Parametrization;
    use crate::maps::impostor::SearchMethod;
    use crate::maps::impostor::room::{BoxRoom, ShinySphere};
    use glam::UVec2;

    const MAP: Parametrization = Parametrization::OctahedronQuadratic;
    /// The middle of the room, which sees nothing of the sphere behind the pillar, and others.
    const PLACES: [DVec3; 4] = [
        DVec3::ZERO,
        DVec3::new(0.1, 0.2, 0.8),
        DVec3::new(0.3, -0.2, 0.7),
        DVec3::new(0.75, 0.3, -0.6),
    ];

    /// Places are colours.
    fn view(place: DVec3, side: u32) -> DepthView {
        let room = BoxRoom::PILLAR;
        let size = UVec2::splat(side);
        let distances = ImpostorImage::from_fn(MAP, size, 1, true, |d| vec![room.surface_from(place, d)]);
        let radiance = MapImage::from_fn(MAP, size, |texel| {
            let d = MAP.texel_direction(size, texel).expect("direction");
            place + room.hit(place, d) * d
        });
        DepthView {
            place,
            distances: distances.expect("distances"),
            radiance: radiance.expect("radiance"),
        }
    }

    fn settings() -> ImpostorSettings {
        ImpostorSettings {
            tolerance: 5e-3,
            ..ImpostorSettings::of(SearchMethod::March, 64)
        }
    }

    #[test]
    fn further_views_show_what_the_first_does_not() {
        let sphere = ShinySphere::P2;
        let rays = sphere.rays(32, None);
        let mut last = 0.0;
        for count in [1, 2, 4] {
            let views = PLACES[..count].iter().map(|place| view(*place, 96)).collect();
            let views = BlendedViews::new(views, settings()).expect("views");
            let mut good = 0;
            for ray in &rays {
                let hit = ray.origin + sphere.room.hit(ray.origin, ray.direction) * ray.direction;
                let shown = views.look_up(ray);
                // As wide as two texels at the walls.
                good += u32::from((shown.radiance - hit).length() < 0.06);
            }
            let share = f64::from(good) / rays.len() as f64;
            println!("{count} views: {:.1} % are right", 100.0 * share);
            assert!(share > last + 0.02, "{count}: {share} after {last}");
            last = share;
        }
        assert!(last > 0.9, "{last}");
    }

    #[test]
    fn a_views_own_rays_are_its_own() {
        let place = PLACES[1];
        let views = BlendedViews::new(vec![view(PLACES[0], 64), view(place, 64)], settings()).expect("views");
        let size = UVec2::splat(64);
        let (mut all, mut own) = (0, 0);
        for texel in MAP.texels(size).step_by(37) {
            let direction = MAP.texel_direction(size, texel).expect("direction");
            let ray = ImpostorRay {
                origin: place,
                direction,
            };
            let shown = views.look_up(&ray);
            let expected = views.views[1].radiance.at(texel).as_dvec3();
            assert!(shown.views > 0, "{texel:?}: {shown:?}");
            // The other view has a weight of a millionth, but where it takes the edge of the pillar for a nearer surface.
            own += u32::from((shown.radiance - expected).length() < 1e-4);
            all += 1;
        }
        println!("{own} of {all} are the view's own");
        assert!(100 * own > 97 * all, "{own} of {all}");
    }

    #[test]
    fn views_that_are_none_are_refused() {
        let one = view(DVec3::ZERO, 16);
        let cases = [
            (Vec::new(), settings(), "views: 0"),
            (vec![one.clone(); 17], settings(), "views: 17"),
            (
                vec![DepthView {
                    place: DVec3::NAN,
                    ..one.clone()
                }],
                settings(),
                "is not finite",
            ),
            (vec![one], ImpostorSettings { steps: 0, ..settings() }, "impostor steps"),
        ];
        for (views, settings, words) in cases {
            let error = BlendedViews::new(views, settings).expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
