//! Older ways to mirrors and gems: virtual vertices behind a sphere, a second eye behind a facet, and views blended by their depths.
//!
//! Oracle: exact reflections, refractions and hits of rays.

use clerestory::Result;
use clerestory::maps::impostor::proxy::refracted;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::views::{BlendedViews, DepthView};
use clerestory::maps::impostor::{ImpostorImage, ImpostorRay, ImpostorSettings, SearchMethod};
use clerestory::maps::{MapImage, Parametrization};
use clerestory::raster::curved_mirror::{SphereMirror, VirtualTriangle};
use clerestory::raster::facet::Facet;
use glam::{DVec3, UVec2};

use super::exact_room::mean;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;

/// Cells along a side of each wall, two triangles each.
const CELLS: [u32; 4] = [4, 8, 16, 32];
/// Index of diamond.
pub(super) const INDEX: f64 = 2.42;
/// Angles of incidence at a facet's middle, and half of what it is seen under from the eye, degrees.
const TILTS: [f64; 3] = [0.0, 30.0, 60.0];
const HALVES: [f64; 3] = [1.0, 2.0, 4.0];
/// Places of views: the room's middle, which sees nothing of the sphere behind the pillar, and others.
pub(super) const PLACES: [DVec3; 4] = [
    DVec3::ZERO,
    DVec3::new(0.1, 0.2, 0.8),
    DVec3::new(0.3, -0.2, 0.7),
    DVec3::new(0.75, 0.3, -0.6),
];
pub(super) const MAP: Parametrization = Parametrization::OctahedronQuadratic;

rows! {
    /// Walls in triangles.
    struct Curved = "A room in a mirror sphere by virtual vertices" by [triangles] {
        triangles: u64 = "triangles of the walls",
        rays: u64 = "rays",
        mean: f64 = "mean error (°)",
        of_coarser: Option<f64> = "over that of triangles twice as large",
        largest: f64 = "largest (°)",
        missing: f64 = "rays that show nothing (%)",
    }
}
rows! {
    /// A facet.
    struct Gem = "Rays into a diamond by a second eye" by [tilt, half] {
        tilt: f64 = "incidence at the middle (°)",
        half: f64 = "facet's half angle from the eye (°)",
        middle: f64 = "error in the middle (°)",
        largest: f64 = "largest error (°)",
        share: f64 = "largest over the half angle",
    }
}
rows! {
    /// Several views.
    struct Views = "Rays of a sphere behind a pillar by views of several places" by [views] {
        views: u64 = "views",
        good: f64 = "right within 0.06 of the room's half width (%)",
        mean: f64 = "mean distance of what is shown from the hit",
        blended: f64 = "views that show a ray, in the mean",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    curved: Vec<Curved>,
    gems: Vec<Gem>,
    views: Vec<Views>,
}

const OF_CURVED: &[Criterion<Curved>] = &[
    Criterion::each(
        "triangles half as large err by a quarter: mean error over that of coarser ones",
        Bound::AtMost(1.0 / 3.0),
        |row: &Curved| row.of_coarser.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.of_coarser.is_some())
    .because("images bend by the square of a triangle's size"),
    Criterion::each(
        "the finest walls: mean error (°)",
        Bound::AtMost(0.1),
        |row: &Curved| row.mean.into(),
    )
    .among(|row| row.triangles == triangles(CELLS[3])),
];
const OF_GEMS: &[Criterion<Gem>] = &[
    Criterion::each("the middle is exact: error (°)", Bound::AtMost(1e-5), |row: &Gem| {
        row.middle.into()
    })
    .in_every_form(),
    Criterion::each(
        "errors are a part of the facet's angle: largest over half of it",
        Bound::AtMost(0.375),
        |row: &Gem| row.share.into(),
    )
    .in_every_form(),
];
const OF_VIEWS: &[Criterion<Views>] = &[
    Criterion::each(
        "one place hides most of it: rays that are right (%)",
        Bound::AtMost(50.0),
        |row: &Views| row.good.into(),
    )
    .among(|row| row.views == 1),
    Criterion::each(
        "four show it: rays that are right (%)",
        Bound::AtLeast(90.0),
        |row: &Views| row.good.into(),
    )
    .among(|row| row.views == 4),
];

/// Triangles of six walls of so many cells along a side.
pub(super) fn triangles(cells: u32) -> u64 {
    12 * u64::from(cells) * u64::from(cells)
}

/// All walls of the room in triangles.
pub(super) fn walls(cells: u32) -> Vec<[DVec3; 3]> {
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
    let wall = |wall: u32| {
        let axis = wall as usize / 2;
        let side = if wall.is_multiple_of(2) { 1.0 } else { -1.0 };
        let [u, v] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
        (0..cells * cells).flat_map(move |cell| {
            let corner = |i: u32, j: u32| side * DVec3::AXES[axis] + at(i) * u + at(j) * v;
            let (i, j) = (cell % cells, cell / cells);
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
    };
    (0..6).flat_map(wall).collect()
}

/// A mirror sphere half-way to a wall, its room drawn by virtual vertices.
fn curved(cells: u32, side: u32, coarser: &mut Option<f64>) -> Curved {
    let sphere = ShinySphere::B;
    let (eye, mirror) = (
        sphere.camera,
        SphereMirror {
            centre: sphere.centre,
            radius: sphere.radius,
        },
    );
    let drawn: Vec<VirtualTriangle> = walls(cells)
        .into_iter()
        .filter_map(|corners| VirtualTriangle::new(&mirror, eye, corners))
        .collect();
    let rays = sphere.rays(side, None);
    let (mut errors, mut missing) = (Vec::new(), 0u32);
    for ray in &rays {
        let direction = (ray.origin - eye).normalize();
        let shown = drawn.iter().filter_map(|triangle| triangle.shown(eye, direction));
        match shown.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, point)) => errors.push(ray.direction.angle_between(point - ray.origin).to_degrees()),
            None => missing += 1,
        }
    }
    let mean = mean(&errors);
    let of_coarser = coarser.replace(mean).map(|coarser| mean / coarser);
    Curved {
        triangles: triangles(cells),
        rays: rays.len() as u64,
        mean,
        of_coarser,
        largest: errors.iter().copied().fold(0.0, f64::max),
        missing: 100.0 * f64::from(missing) / rays.len().max(1) as f64,
    }
}

/// A round facet seen from a distance of 1.
fn gem(tilt: f64, half: f64) -> Gem {
    const AROUND: u32 = 16;
    let facet = Facet {
        middle: DVec3::ZERO,
        normal: DVec3::Z,
    };
    let eye = DVec3::new(tilt.to_radians().sin(), 0.0, tilt.to_radians().cos());
    let from = facet.virtual_eye(eye, INDEX).unwrap_or(eye);
    let off = |place: DVec3| {
        let exact = refracted((place - eye).normalize(), facet.normal, 1.0 / INDEX);
        exact.angle_between(place - from).to_degrees()
    };
    let radius = half.to_radians().tan();
    let rim = |i: u32| {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(i) / f64::from(AROUND)).sin_cos();
        off(radius * DVec3::new(cosine, sine, 0.0))
    };
    let largest = (0..AROUND).map(rim).fold(0.0, f64::max);
    Gem {
        tilt,
        half,
        middle: off(facet.middle),
        largest,
        share: largest / half,
    }
}

/// What a place in the room with the pillar sees, coloured by where it is.
fn view(place: DVec3, side: u32) -> Result<DepthView> {
    let (room, size) = (BoxRoom::PILLAR, UVec2::splat(side));
    Ok(DepthView {
        place,
        distances: ImpostorImage::from_fn(MAP, size, 1, true, |d| vec![room.surface_from(place, d)])?,
        radiance: MapImage::from_fn(MAP, size, |texel| {
            let d = MAP.texel_direction(size, texel).unwrap_or(DVec3::Z);
            place + room.hit(place, d) * d
        })?,
    })
}

fn views(count: usize, [pixels, side]: [u32; 2]) -> Result<Views> {
    let sphere = ShinySphere::P2;
    let all: Result<Vec<DepthView>> = PLACES[..count].iter().map(|place| view(*place, side)).collect();
    let settings = ImpostorSettings {
        tolerance: 5e-3,
        ..ImpostorSettings::of(SearchMethod::March, 64)
    };
    let all = BlendedViews::new(all?, settings)?;
    let rays = sphere.rays(pixels, None);
    let of = |ray: &ImpostorRay| {
        let hit = ray.origin + sphere.room.hit(ray.origin, ray.direction) * ray.direction;
        let blend = all.look_up(ray);
        ((blend.radiance - hit).length(), f64::from(blend.views))
    };
    let (apart, blended): (Vec<f64>, Vec<f64>) = rays.iter().map(of).unzip();
    let good = apart.iter().filter(|apart| **apart < 0.06).count();
    Ok(Views {
        views: count as u64,
        good: 100.0 * good as f64 / rays.len().max(1) as f64,
        mean: mean(&apart),
        blended: mean(&blended),
    })
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (side, sizes) = (context.pick(110, 12), context.pick([110, 192], [12, 32]));
        let mut coarser = None;
        let curved = context.each(
            &CELLS,
            |cells| format!("{} triangles", triangles(*cells)),
            |cells| Ok(vec![curved(*cells, side, &mut coarser)]),
        )?;
        let gems = TILTS.iter().flat_map(|tilt| HALVES.map(|half| gem(*tilt, half)));
        let views = context.each(
            &[1, 2, 3, 4],
            |count| format!("{count} views"),
            |count| Ok(vec![views(*count, sizes)?]),
        )?;
        Ok(Self {
            curved,
            gems: gems.collect(),
            views,
        })
    }

    fn findings(&self) -> Findings {
        let finest = self.curved.last().map(|row| row.mean.into());
        Findings::of(&self.curved, OF_CURVED)
            .headline("mean error of a room in a sphere by virtual vertices (°)", finest)
            .note("The sphere stands half-way to a wall of a room of half width 1. Angles are those at the sphere between what is shown and the exact reflection; a triangle one of whose corners the eye does not see in the sphere is not drawn.")
            .and(Findings::of(&self.gems, OF_GEMS).note("Angles are those within the body; facets are round, and a tilted eye sees them narrower."))
            .and(Findings::of(&self.views, OF_VIEWS).note("Maps of 192² texels, in which rays are marched for; the first place is the room's middle, which sees nothing of the sphere."))
            .curves(
                "virtual-vertices",
                "Errors by virtual vertices",
                Axes::rates("triangles of the walls", "mean error (°)"),
                curves(
                    &self.curved,
                    |_| "virtual vertices".into(),
                    |row| (row.triangles as f64, row.mean.max(1e-6).into()),
                ),
            )
    }
}
