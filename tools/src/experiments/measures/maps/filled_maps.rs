//! Maps of directions filled from a scene, in every way that there is, and what rays see in their place.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::shaders::types::{SceneTriangle, Surfel};
use clerestory::gpu::{Area, Category, Gpu, Recorder, Timings};
use clerestory::maps::cube::CUBE_FACES;
use clerestory::maps::octahedron::OctahedronLayout;
use clerestory::maps::{MapPoint, Parametrization, Texel};
use clerestory::raster::octants::Emitted;
use clerestory::raster::splats::{Splat, SplatMap, surfels_of};
use clerestory::raster::{GBuffer, GBufferDesc, Layering, OctantCut, Output, View};
use clerestory::transport::GpuScene;
use clerestory::{Result, scene};
use glam::{DVec3, UVec2, Vec3, Vec4};
use rayon::prelude::*;

/// Points splatted for each texel.
pub const SPLATS_PER_TEXEL: u32 = 4;

/// How a map is filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// By the rasterizer.
    Raster(Layering),
    /// By points, with the fill of holes.
    Splats,
}

/// A map, and how it is filled.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// In tables.
    pub name: String,
    /// Frames a second of the document's table for it.
    pub stated: Option<f64>,
    /// The map.
    pub map: Parametrization,
    /// How it is filled.
    pub way: Way,
    /// Texels of a layer.
    pub size: UVec2,
}

/// With about `side`² texels in all (512, 724 × 362, 209 and 362 for the document's 512), without a figure of the document.
pub fn variant(name: impl Into<String>, map: Parametrization, way: Way, side: u32) -> Variant {
    Variant {
        name: name.into(),
        stated: None,
        map,
        way,
        size: map.size_for(f64::from(side).powi(2)),
    }
}

const SQUARE: Parametrization = Parametrization::OctahedronQuadratic;
const RECTANGLE: Parametrization = Parametrization::OctahedronRectangular;

/// Every way, with pieces of triangles at that level for those that need them.
pub fn variants(side: u32, level: u32) -> Vec<Variant> {
    let octants = |cut| Way::Raster(Layering::Octants(cut));
    let faces = |layering: fn(u32) -> Layering| Way::Raster(layering(CUBE_FACES));
    let paraboloids = |level| Way::Raster(Layering::Paraboloids { level });
    let unsplit = |level| octants(OctantCut::Unsplit { level });
    let all = [
        ("4a split, square", Some(16.0), SQUARE, octants(OctantCut::Split)),
        ("4a split, rectangle", None, RECTANGLE, octants(OctantCut::Split)),
        (
            "4b halves, rectangle",
            Some(34.0),
            RECTANGLE,
            octants(OctantCut::Halves),
        ),
        (
            "4c outlines, rectangle",
            Some(3.0),
            RECTANGLE,
            octants(OctantCut::Outlines),
        ),
        (
            "4d mask by instances, square",
            Some(95.0),
            SQUARE,
            octants(OctantCut::Mask),
        ),
        (
            "4d mask in 8 rectangles, square",
            Some(95.0),
            SQUARE,
            octants(OctantCut::MaskInRectangles),
        ),
        ("4e unsplit, square", None, SQUARE, unsplit(1)),
        ("4e unsplit, rectangle", None, RECTANGLE, unsplit(1)),
        ("4f splats and fill, square", None, SQUARE, Way::Splats),
        (
            "4g clip distances, square",
            None,
            SQUARE,
            octants(OctantCut::ClipDistances),
        ),
        (
            "4g clip distances, rectangle",
            None,
            RECTANGLE,
            octants(OctantCut::ClipDistances),
        ),
        (
            "cube by passes",
            Some(250.0),
            Parametrization::Cube,
            faces(Layering::Passes),
        ),
        (
            "cube by instances",
            Some(250.0),
            Parametrization::Cube,
            faces(Layering::Instances),
        ),
        (
            "cube by geometry shader",
            Some(250.0),
            Parametrization::Cube,
            faces(Layering::Geometry),
        ),
        ("dual paraboloid", None, Parametrization::DualParaboloid, paraboloids(1)),
    ];
    let mut variants: Vec<_> = all
        .into_iter()
        .map(|(name, stated, map, way)| Variant {
            stated,
            ..variant(name, map, way, side)
        })
        .collect();
    variants.push(variant(
        format!("4e unsplit, square, level {level}"),
        SQUARE,
        unsplit(level),
        side,
    ));
    let name = format!("dual paraboloid, level {level}");
    variants.push(variant(name, Parametrization::DualParaboloid, paraboloids(level), side));
    variants
}

/// A scene, and the place in it that maps are of.
pub struct FilledScene {
    pub on_device: GpuScene,
    pub corners: Vec<[Vec3; 3]>,
    pub index: Bvh2,
    pub origin: Vec3,
    near: f32,
}

/// What a map holds: by layers and rows.
pub struct Filled {
    pub triangles: Vec<u32>,
    pub distances: Vec<f32>,
    /// From the map's middle; none of points.
    pub positions: Vec<Option<DVec3>>,
}

/// What rays see at the texels of a map: none where they hold no direction.
pub struct Seen {
    pub directions: Vec<Option<DVec3>>,
    pub hits: Vec<Hit>,
}

/// Work of one filling.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    pub vertices: u64,
    pub primitives: u64,
    pub emitted_corners: u64,
    pub fragments: u64,
}

/// Records the filling of a map.
type Record<'a> = Box<dyn Fn(&mut Recorder) -> Result<()> + 'a>;

/// A map that is ready to be filled again and again.
pub struct Filling<'a> {
    gpu: Gpu,
    record: Record<'a>,
}

impl Filling<'_> {
    fn run(&self, counts: bool) -> Result<Timings> {
        let mut recorder = self.gpu.recorder("live map")?;
        if counts {
            recorder.count_invocations();
        }
        (self.record)(&mut recorder)?;
        recorder.submit()?.wait()
    }

    /// Seconds of the device for one filling.
    pub fn seconds(&self) -> Result<f64> {
        Ok(self.run(false)?.seconds())
    }
}

impl FilledScene {
    /// Loads a scene; `share` is the place in the box around it.
    pub fn load(gpu: &Gpu, address: &str, share: Vec3) -> Result<Self> {
        let on_device = GpuScene::new(gpu, &scene::load(address)?)?;
        let surfaces = on_device.surfaces();
        let view = surfaces.set.scene_triangles.buffer().view();
        let triangles: Vec<SceneTriangle> = gpu.read(view, surfaces.triangles as usize)?;
        let corners: Vec<_> = triangles
            .iter()
            .map(|t| [t.a, t.b, t.c].map(Vec3::from_array))
            .collect();
        let [lower, upper] = surfaces.bounds;
        let origin = lower + share * (upper - lower);
        Ok(Self {
            index: Bvh2::build(&corners, &Bvh2Settings::default())?,
            near: View::near_plane(origin, &surfaces),
            on_device,
            corners,
            origin,
        })
    }

    /// A ray from the map's middle, whose parameter is the distance.
    pub fn ray(&self, direction: DVec3) -> Ray {
        Ray {
            origin: self.origin.to_array(),
            t_min: self.near,
            direction: direction.as_vec3().to_array(),
            t_max: f32::INFINITY,
        }
    }

    /// What rays see.
    pub fn seen(&self, map: Parametrization, size: UVec2) -> Seen {
        let texels: Vec<_> = map.texels(size).collect();
        let directions: Vec<_> = texels
            .par_iter()
            .map(|texel| map.texel_direction(size, *texel))
            .collect();
        let hit = |direction: &Option<DVec3>| {
            let ray = self.ray(direction.unwrap_or(DVec3::Z));
            self.index.closest_hit(&ray)
        };
        let hits = directions.par_iter().map(hit).collect();
        Seen { directions, hits }
    }

    fn views(&self, variant: &Variant) -> Result<Vec<View>> {
        let area = Area::whole(variant.size.to_array());
        let (origin, near) = (self.origin, self.near);
        match variant.map {
            Parametrization::Cube => (0..CUBE_FACES)
                .map(|face| View::of_cube_face(origin, face, near, area))
                .collect(),
            Parametrization::DualParaboloid => (0..2)
                .map(|half| View::of_paraboloid(origin, half, near, area))
                .collect(),
            map => View::of_octants(origin, layout_of(map), near, area),
        }
    }

    fn gbuffer(&self, gpu: &Gpu, variant: &Variant, layering: Layering, outputs: &[Output]) -> Result<GBuffer> {
        let desc = GBufferDesc {
            size: variant.size.to_array(),
            layering,
            outputs,
        };
        GBuffer::interpolated(gpu, &self.on_device.surfaces(), &desc)
    }

    fn surfels(&self, variant: &Variant) -> Vec<Surfel> {
        surfels_of(&self.corners, SPLATS_PER_TEXEL * variant.size.element_product())
    }

    /// Fills a map and reads it.
    pub fn fill(&self, gpu: &Gpu, variant: &Variant) -> Result<Filled> {
        let Way::Raster(layering) = variant.way else {
            let map = SplatMap::new(gpu, layout_of(variant.map), variant.size)?;
            let splats = map.splat(gpu, self.origin, &self.surfels(variant), true)?;
            let number = |splat: &Option<Splat>| splat.map_or(u32::MAX, |splat| splat.number);
            let distance = |splat: &Option<Splat>| splat.map_or(f32::INFINITY, |splat| splat.distance);
            return Ok(Filled {
                triangles: splats.iter().map(number).collect(),
                distances: splats.iter().map(distance).collect(),
                positions: vec![None; splats.len()],
            });
        };
        let outputs = [Output::Triangle, Output::Distance, Output::Position];
        let gbuffer = self.gbuffer(gpu, variant, layering, &outputs)?;
        let mut recorder = gpu.recorder("live map")?;
        gbuffer.record(&mut recorder, &self.on_device.surfaces(), &self.views(variant)?)?;
        recorder.submit()?.wait()?;
        let positions: Vec<[f32; 4]> = gbuffer.read(gpu, Output::Position)?;
        let origin = self.origin.as_dvec3();
        let from = |p: [f32; 4]| (p[3] > 0.0).then(|| Vec4::from_array(p).truncate().as_dvec3() - origin);
        Ok(Filled {
            triangles: gbuffer.read(gpu, Output::Triangle)?,
            distances: gbuffer.read(gpu, Output::Distance)?,
            positions: positions.into_iter().map(from).collect(),
        })
    }

    /// Makes ready to fill a map of distances, as shadows want it, and fills it once to count and to warm up.
    pub fn filling(&self, gpu: &Gpu, variant: &Variant) -> Result<(Filling<'_>, Work)> {
        let surfaces = self.on_device.surfaces();
        let points = SPLATS_PER_TEXEL * variant.size.element_product();
        let record: Record<'_> = match variant.way {
            Way::Raster(layering) => {
                let gbuffer = self.gbuffer(gpu, variant, layering, &[Output::Distance])?;
                let views = self.views(variant)?;
                Box::new(move |recorder| gbuffer.record(recorder, &surfaces, &views))
            }
            Way::Splats => {
                let map = SplatMap::new(gpu, layout_of(variant.map), variant.size)?;
                let buffer = gpu.buffer_with("surfels", Category::Geometry, &self.surfels(variant))?;
                let origin = self.origin;
                Box::new(move |recorder| map.record(recorder, origin, &buffer, points, true))
            }
        };
        let filling = Filling {
            gpu: gpu.clone(),
            record,
        };
        let counted = filling.run(true)?;
        let drawn = counted.passes[0].drawn.unwrap_or_default();
        let points = u64::from(points);
        let work = match variant.way {
            Way::Raster(_) => Work {
                vertices: drawn.vertices,
                primitives: drawn.primitives,
                emitted_corners: self.emitted_corners(variant, drawn.primitives),
                fragments: drawn.fragments,
            },
            Way::Splats => Work {
                vertices: points,
                primitives: points,
                emitted_corners: points,
                fragments: 0,
            },
        };
        Ok((filling, work))
    }

    /// Corners that reach the rasterizer: of strips by the cuts' twins, of triangles three each.
    fn emitted_corners(&self, variant: &Variant, primitives: u64) -> u64 {
        let Way::Raster(Layering::Octants(cut @ (OctantCut::Split | OctantCut::Halves | OctantCut::Outlines))) =
            variant.way
        else {
            return 3 * primitives;
        };
        let emitted = self
            .corners
            .iter()
            .map(|t| cut.emitted(t.map(|corner| corner - self.origin)));
        emitted.fold(Emitted::default(), Emitted::and).corners as u64
    }
}

fn layout_of(map: Parametrization) -> OctahedronLayout {
    if map == RECTANGLE {
        OctahedronLayout::Rectangular
    } else {
        OctahedronLayout::Quadratic
    }
}

/// Where the texel of a place is in a [`Filled`].
pub fn texel_index(size: UVec2, at: MapPoint) -> usize {
    let place = (at.uv * size.as_dvec2()).as_uvec2().min(size - 1);
    let texel = Texel {
        layer: at.layer,
        x: place.x,
        y: place.y,
    };
    ((texel.layer * size.y + texel.y) * size.x + texel.x) as usize
}
