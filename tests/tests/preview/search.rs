//! Searched reflections: what a mirror sphere shows of a room of six colours, beside exact rays, and searches that cannot be.

use clerestory::Error;
use clerestory::gpu::Gpu;
use clerestory::maps::impostor::ImpostorSettings;
use clerestory::scene::{Camera, Material};
use clerestory::techniques::preview::{
    LightProbeDesc, LiveProbe, Preview, PreviewDesc, PreviewPart, ProbeMap, SearchedReflections,
};
use clerestory::transport::GpuScene;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

use crate::live::{face, is_at_edge, room};
use crate::subject::sphere;

const SIZE: u32 = 64;
const SIDE: u32 = 256;
/// Where the map is drawn, beside the sphere.
const PLACE: DVec3 = DVec3::new(-0.1, 0.15, 0.1);
const CENTRE: DVec3 = DVec3::new(0.5, 0.0, 0.0);
const RADIUS: f64 = 0.3;
const EYE: DVec3 = DVec3::new(-0.8, 0.1, -0.7);
const FOV: f32 = 0.45;

fn camera() -> Camera {
    Camera::look_at("main", EYE, CENTRE, DVec3::Y, FOV)
}

/// A frame of the room with the sphere.
struct Drawn {
    picture: Vec<f32>,
    passes: Vec<String>,
    /// Of the live map.
    bytes: u64,
}

/// The room of six colours with a mirror sphere, its last object.
struct Stage {
    on_device: GpuScene,
    colors: [Vec3; 6],
    preview: Preview,
    object: u32,
}

impl Stage {
    fn new(gpu: &Gpu) -> Self {
        let (mut scene, colors) = room();
        let mirror = scene.add_material(Material::mirror("mirror", Vec3::ONE));
        let object = scene.instances.len() as u32;
        scene.place(sphere("mirror", mirror, CENTRE.as_vec3(), RADIUS as f32, 96));
        let on_device = GpuScene::new(gpu, &scene).unwrap();
        let desc = PreviewDesc {
            size: [SIZE; 2],
            samples: 1,
            lights: 0,
            shadows: None,
            probes: Some(ProbeMap::Octahedron),
        };
        Self {
            preview: Preview::new(gpu, &on_device, desc).unwrap(),
            on_device,
            colors,
            object,
        }
    }

    fn live(&self, gpu: &Gpu, with_distances: bool) -> LiveProbe {
        let make = match with_distances {
            true => LiveProbe::with_distances,
            false => LiveProbe::new,
        };
        let desc = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: SIDE,
            finest: 32,
        };
        make(gpu, &self.on_device, &self.preview, desc, false).unwrap()
    }

    fn drawn(&self, gpu: &Gpu, search: Option<&ImpostorSettings>) -> Drawn {
        let (scene, preview) = (&self.on_device, &self.preview);
        let surfaces = scene.surfaces();
        let live = self.live(gpu, search.is_some());
        let searched = search.map(|search| SearchedReflections::new(gpu, scene, live.probe(), search).unwrap());
        let mut recorder = gpu.recorder("searched").unwrap();
        let (others, place) = (surfaces.before(self.object), PLACE.as_vec3());
        live.record(&mut recorder, scene, &others, preview, place, None)
            .unwrap();
        let triangles = surfaces.triangles_of(self.object);
        let parts = [
            PreviewPart {
                triangles: 0..triangles.start,
                background: true,
                probe: None,
            },
            PreviewPart {
                triangles: triangles.clone(),
                background: false,
                probe: Some(live.probe()),
            },
        ];
        preview
            .record(&mut recorder, scene, &surfaces, &camera(), &parts)
            .unwrap();
        if let Some(searched) = &searched {
            searched
                .record(&mut recorder, scene, preview, &camera(), triangles, (&live, place))
                .unwrap();
        }
        let timings = recorder.submit().unwrap().wait().unwrap();
        Drawn {
            picture: preview.picture().unwrap().main_layer().unwrap().values().to_vec(),
            passes: timings.passes.into_iter().map(|pass| pass.name).collect(),
            bytes: live.bytes(),
        }
    }
}

/// Values of a picture of searched reflections.
pub fn searched_values(gpu: &Gpu) -> Vec<f32> {
    Stage::new(gpu).drawn(gpu, Some(&ImpostorSettings::default())).picture
}

/// Where the mirrored ray of a pixel's middle meets the room, from the map's place, and which face that is; `None` where it passes by the sphere or close to its rim.
fn exact(pixel: u32) -> Option<(DVec3, usize)> {
    let half = f64::from(0.5 * FOV).tan();
    let at = |i: u32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(SIZE) - 1.0);
    let ray = DVec3::new(at(pixel % SIZE), -at(pixel / SIZE), -1.0);
    let d = camera().transform.transform_vector3(ray).normalize();
    let to_centre = CENTRE - EYE;
    if to_centre.reject_from(d).length() > 0.95 * RADIUS {
        return None;
    }
    let along = d.dot(to_centre);
    let root = along * along - to_centre.length_squared() + RADIUS * RADIUS;
    let from = EYE + (along - root.sqrt()) * d;
    let n = (from - CENTRE) / RADIUS;
    let mirrored = d - 2.0 * d.dot(n) * n;
    let (seen, distance) = face(from, mirrored);
    Some(((from + distance * mirrored - PLACE).normalize(), seen))
}

/// Twelve degrees of parallax: without a search one pixel in twelve and more shows another wall, with it none away from edges. What is searched for costs a pass and twelve bytes a texel, and nothing where it is not asked for.
#[test]
fn a_search_takes_parallax_away() {
    with_gpu(|gpu| {
        let stage = Stage::new(gpu);
        let plain = stage.drawn(gpu, None);
        let searched = stage.drawn(gpu, Some(&ImpostorSettings::default()));
        let (mut all, mut wrong) = (0, [0; 2]);
        for pixel in 0..SIZE * SIZE {
            let [a, b] = [&plain, &searched].map(|drawn| Vec3::from_slice(&drawn.picture[3 * pixel as usize..]));
            let Some((to, seen)) = exact(pixel) else { continue };
            if is_at_edge(PLACE, to, SIDE) {
                continue;
            }
            all += 1;
            for (count, value) in wrong.iter_mut().zip([a, b]) {
                *count += u32::from((value - stage.colors[seen]).abs().max_element() > 0.01);
            }
        }
        let [without, with] = wrong.map(|count| f64::from(count) / f64::from(all));
        println!("of {all} pixels {without:.3} are wrong without a search, {with:.4} with one");
        assert!(all > 1000, "{all}");
        assert!(without > 1.0 / 12.0 && with < 0.002, "{without} {with}");

        // The walls are the same bits; all passes but one are the same.
        let walls = |drawn: &Drawn| drawn.picture[..3 * SIZE as usize].to_vec();
        assert_eq!(walls(&plain), walls(&searched));
        let more = [&plain.passes[..], &["preview: search".to_owned()]].concat();
        assert_eq!(searched.passes, more);
        assert_eq!(searched.bytes, plain.bytes + 12 * u64::from(SIDE * SIDE));
        let again = stage.drawn(gpu, Some(&ImpostorSettings::default()));
        assert_eq!(again.picture, searched.picture);
    });
}

#[test]
fn searches_that_cannot_be_are_refused() {
    with_gpu(|gpu| {
        let stage = Stage::new(gpu);
        let search = ImpostorSettings::default();
        let live = [false, true].map(|with_distances| stage.live(gpu, with_distances));
        let many = ImpostorSettings { steps: 257, ..search };
        let error = SearchedReflections::new(gpu, &stage.on_device, live[1].probe(), &many).unwrap_err();
        assert!(error.to_string().contains("impostor steps"), "{error}");
        let searched = SearchedReflections::new(gpu, &stage.on_device, live[1].probe(), &search).unwrap();
        let refused = |preview: &Preview, live: &LiveProbe, place: Vec3| {
            let mut recorder = gpu.recorder("refused").unwrap();
            let triangles = stage.on_device.surfaces().triangles_of(stage.object);
            searched.record(
                &mut recorder,
                &stage.on_device,
                preview,
                &camera(),
                triangles,
                (live, place),
            )
        };
        let without = PreviewDesc {
            probes: None,
            ..stage.preview.desc()
        };
        let without = Preview::new(gpu, &stage.on_device, without).unwrap();
        for (preview, live, place, words) in [
            (&stage.preview, &live[0], Vec3::ZERO, "no distances"),
            (&stage.preview, &live[1], Vec3::NAN, "place"),
            (&without, &live[1], Vec3::ZERO, "PreviewDesc::probes is needed"),
        ] {
            let error = refused(preview, live, place).unwrap_err();
            assert!(
                matches!(error, Error::Setting { .. }) && error.to_string().contains(words),
                "{error}"
            );
        }
    });
}
