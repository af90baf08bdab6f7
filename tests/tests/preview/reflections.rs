//! Reflection maps that are drawn each frame, as octahedra and as latitude–longitude maps: mirrors against rays, seams, frames one after the other, and
//! tables against the sums of their texels.

use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::spherical_sat::SatImage;
use clerestory::techniques::preview::{Preview, PreviewDesc, ReflectionMap, ReflectionMapDesc};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{Vec3, Vec4};

use crate::live::{face, is_at_edge, room};
use crate::subject::Subject;

const OCTAHEDRON: ReflectionMapDesc = ReflectionMapDesc {
    side: 128,
    lat_long: None,
    border: 16,
};
/// About as many texels, made of an octahedron of four times as many.
const LAT_LONG: ReflectionMapDesc = ReflectionMapDesc {
    side: 256,
    lat_long: Some(90),
    border: 16,
};
const FORMS: [ReflectionMapDesc; 2] = [OCTAHEDRON, LAT_LONG];
const PLACE: Vec3 = Vec3::new(0.2, -0.3, 0.1);

fn preview(gpu: &Gpu, subject: &Subject) -> Preview {
    let desc = PreviewDesc {
        size: [8, 8],
        samples: 1,
        lights: 0,
        shadows: None,
        probes: None,
    };
    Preview::new(gpu, &subject.on_device, desc).unwrap()
}

/// A map that is drawn at places one after the other.
fn drawn(gpu: &Gpu, subject: &Subject, desc: ReflectionMapDesc, places: &[Vec3]) -> ReflectionMap {
    let (scene, preview) = (&subject.on_device, preview(gpu, subject));
    let reflection = ReflectionMap::new(gpu, scene, &preview, desc, false).unwrap();
    for place in places {
        let mut recorder = gpu.recorder("reflection").unwrap();
        reflection
            .record(&mut recorder, scene, &scene.surfaces(), &preview, *place, None)
            .unwrap();
        let passes = recorder.submit().unwrap().wait().unwrap().passes;
        let names: Vec<_> = passes.iter().map(|pass| pass.name.as_str()).collect();
        let mut expected = vec!["raster: surfaces", "preview: shade live map"];
        expected.extend(desc.lat_long.map(|_| "reflection: latitude and longitude"));
        expected.extend(["reflection: border", "reflection: table"]);
        assert_eq!(names, expected);
    }
    reflection
}

/// Off the edges of faces a mirror shows the face that its ray meets.
#[test]
fn mirrors_show_what_rays_meet_in_either_form() {
    with_gpu(|gpu| {
        let (scene, colors) = room();
        let subject = Subject::new(gpu, &scene);
        for desc in FORMS {
            let reflection = drawn(gpu, &subject, desc, &[PLACE]);
            let mut random = Random(41);
            let mut queries: Vec<Vec4> = (0..3000).map(|_| random.direction().extend(0.0)).collect();
            // About the poles, where rows of texels meet.
            queries.extend((0..300).map(|i| {
                let d = random.direction();
                let pole = if i % 2 == 0 { Vec3::Z } else { Vec3::NEG_Z };
                (pole + 0.02 * d).normalize().extend(0.0)
            }));
            let found = reflection.map().look_up(&queries).unwrap();
            // A row of the latitude–longitude map is 0.035 high: a look-up takes texels as far as 0.075, and those were taken of an octahedron's.
            let side = if desc.lat_long.is_some() { 80 } else { desc.side };
            let mut inside = 0;
            for (query, value) in queries.iter().zip(&found) {
                let d = query.truncate().as_dvec3();
                if is_at_edge(PLACE.as_dvec3(), d, side) {
                    continue;
                }
                inside += 1;
                let exact = colors[face(PLACE.as_dvec3(), d).0];
                // Sums of four texels, of four look-ups each.
                let off = (*value - exact).abs().max_element();
                assert!(off < 1e-5, "{desc:?}: {d} {value} instead of {exact}");
            }
            println!("{desc:?}: {inside} of {} off edges", queries.len());
            assert!(2 * inside > queries.len(), "{desc:?}: {inside}");
        }
    });
}

/// What is looked up at both sides of a seam is the same.
#[test]
fn maps_of_a_frame_have_no_seams() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, &room().0);
        for desc in FORMS {
            let reflection = drawn(gpu, &subject, desc, &[PLACE]);
            let mut random = Random(42);
            let pairs: Vec<[Vec4; 2]> = (0..400)
                .map(|i| {
                    let d = random.direction();
                    let sides = [1e-6, -1e-6].map(|side| match (desc.lat_long, i % 4) {
                        // Below the equator the octahedron is cut along x = 0 and y = 0.
                        (None, 0 | 1) => Vec3::new(side, d.y, -d.z.abs()),
                        (None, _) => Vec3::new(d.x, side, -d.z.abs()),
                        // The other map where longitudes begin, and through its poles.
                        (Some(_), 0 | 1) => Vec3::new(0.1 + d.x.abs(), side, d.z),
                        (Some(_), 2) => Vec3::new(side * d.x, side * d.y, 1.0),
                        (Some(_), _) => Vec3::new(side * d.x, side * d.y, -1.0),
                    });
                    sides.map(|d| d.normalize().extend(0.0))
                })
                .collect();
            let found = reflection.map().look_up(pairs.as_flattened()).unwrap();
            let mut worst = 0.0f32;
            for (pair, queries) in found.as_chunks::<2>().0.iter().zip(&pairs) {
                let jump = (pair[0] - pair[1]).abs().max_element();
                // Twice 10⁻⁶ and places off by as much, of 128 texels between which radiance changes by up to 1 along each axis.
                assert!(jump < 1e-3, "{desc:?}: {jump} between {queries:?}");
                worst = worst.max(jump);
            }
            println!("{desc:?}: jumps of up to {worst:.1e}");
            // No face is darker than 0.1: a border that was not filled is black.
            assert!(found.iter().all(|value| value.min_element() > 0.09), "{desc:?}");
        }
    });
}

/// Nothing is left of the frame before.
#[test]
fn each_frame_is_drawn_anew() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, &room().0);
        let other = Vec3::new(-0.4, 0.5, -0.6);
        let mut random = Random(43);
        let queries: Vec<Vec4> = (0..200).map(|_| random.direction().extend(0.05)).collect();
        for desc in FORMS {
            let held = |places: &[Vec3]| {
                let reflection = drawn(gpu, &subject, desc, places);
                let (_, texels) = reflection.map().read_tile(0).unwrap();
                (texels, reflection.table().look_up(&queries).unwrap())
            };
            let alone = held(&[PLACE]);
            assert!(held(&[other, PLACE]) == alone, "{desc:?}");
            let moved = held(&[PLACE, other]);
            assert!(moved.0 != alone.0 && moved.1 != alone.1, "{desc:?}");
        }
    });
}

/// Boxes of the table are means of the texels that there are, over seams too.
#[test]
fn tables_hold_the_means_of_boxes_of_the_frame() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, &room().0);
        for desc in FORMS {
            let reflection = drawn(gpu, &subject, desc, &[PLACE]);
            let image = reflection.map().read(0).unwrap();
            let map = image.map();
            assert_eq!(map == Parametrization::LatLong, desc.lat_long.is_some());
            let twin = SatImage::new(&image, desc.border).unwrap();
            let mut random = Random(44);
            let queries: Vec<Vec4> = (0..400)
                .map(|i| random.direction().extend(0.02 + 0.0002 * i as f32))
                .collect();
            let found = reflection.table().look_up(&queries).unwrap();
            let mut worst = 0.0f64;
            for (query, value) in queries.iter().zip(&found) {
                let at = map.encode(query.truncate().as_dvec3()).unwrap();
                let expected = twin.sat_mean(at.uv, query.w.into());
                worst = worst.max((value.as_dvec3() - expected).abs().max_element());
            }
            println!("{desc:?}: off by {worst:.1e}");
            // Boxes are at least 3.6 texels wide, and places off by 10⁻⁶ of 180: at each side 10⁻⁴ of what the box holds, of radiance up to 1.
            assert!(worst < 4e-4, "{desc:?}: {worst}");
        }
    });
}

#[test]
fn sizes_that_cannot_be_are_refused() {
    with_gpu(|gpu| {
        let subject = Subject::new(gpu, &room().0);
        let preview = preview(gpu, &subject);
        let new = |desc| ReflectionMap::new(gpu, &subject.on_device, &preview, desc, false);
        for wrong in [
            ReflectionMapDesc { side: 1, ..OCTAHEDRON },
            ReflectionMapDesc {
                side: 8192,
                ..OCTAHEDRON
            },
            ReflectionMapDesc {
                border: 0,
                ..OCTAHEDRON
            },
            ReflectionMapDesc {
                border: 129,
                ..OCTAHEDRON
            },
            ReflectionMapDesc {
                lat_long: Some(1),
                ..LAT_LONG
            },
            ReflectionMapDesc { border: 91, ..LAT_LONG },
        ] {
            assert!(new(wrong).is_err(), "{wrong:?}");
        }
        let small = ReflectionMapDesc {
            side: 16,
            lat_long: None,
            border: 2,
        };
        // Drawn from nowhere.
        let (reflection, scene) = (new(small).unwrap(), &subject.on_device);
        let mut recorder = gpu.recorder("nowhere").unwrap();
        let place = Vec3::new(0.0, f32::NAN, 0.0);
        let refused = reflection.record(&mut recorder, scene, &scene.surfaces(), &preview, place, None);
        assert!(refused.is_err());
        // Map, table and pictures: a table has 32 bytes for each texel with its border, and one line more.
        assert!(reflection.bytes() > 12 * 20 * 20 + 32 * 21 * 21);
    });
}
