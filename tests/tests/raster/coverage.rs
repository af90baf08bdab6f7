//! Bounds of fragments: against the twin, and against what is counted.

use clerestory::gpu::Area;
use clerestory::maps::octahedron::OctahedronLayout;
use clerestory::raster::View;
use clerestory::raster::coverage::{Coverage, fragments};
use clerestory::scene::{Camera, Material, Mesh, Projection, Scene};
use clerestory_tests::random::Random;
use clerestory_tests::render::upload;
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3, Vec3};

const SIZE: [u32; 2] = [48, 32];
const BLOCK: usize = 64;

/// Triangles of all sizes on all sides of the origin, some of them around it.
fn triangles(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let triangle = |_| {
        let (middle, size) = (4.0 * random.vector(), random.magnitude(-3, 1));
        std::array::from_fn(|_| middle + size * random.vector())
    };
    (0..count).map(triangle).collect()
}

fn scene_of(triangles: &[[Vec3; 3]], is_flat: bool) -> Scene {
    let mut scene = Scene::default();
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.place(Mesh {
        name: "triangles".into(),
        positions: triangles.concat(),
        triangles: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        material: Some(grey),
        ..Mesh::default()
    });
    let (eye, target) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, 0.0, 0.5));
    let mut camera = Camera::look_at("main", eye, target, DVec3::Y, 1.2);
    if is_flat {
        camera.projection = Projection::Orthographic { half_height: 2.0 };
    }
    scene.cameras.push(camera);
    scene
}

/// Pixel centres inside of a triangle's picture, which all of its corners lie in front of.
fn covered(view: &View, corners: [DVec3; 3]) -> Option<u32> {
    let clip = corners.map(|corner| view.project(corner));
    if clip.iter().any(|[_, _, z, w]| z > w) {
        return None;
    }
    let size = DVec2::from(SIZE.map(f64::from));
    let [a, b, c] = clip.map(|[x, y, _, w]| (0.5 * DVec2::new(x, y) / w + 0.5) * size);
    let side = |p: DVec2, q: DVec2, at: DVec2| (q - p).perp_dot(at - p);
    let is_in = |at: DVec2| {
        let sides = [side(a, b, at), side(b, c, at), side(c, a, at)];
        sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
    };
    let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| DVec2::new(x.into(), y.into()) + 0.5));
    Some(pixels.filter(|at| is_in(*at)).count() as u32)
}

#[test]
fn bounds_are_those_of_the_twin_and_no_less_than_what_is_covered() {
    with_gpu(|gpu| {
        let mut random = Random(7);
        // A last block that is not full, and of one triangle.
        let triangles = triangles(&mut random, 5 * BLOCK + 1);
        let area = Area::whole(SIZE);
        let coverage = Coverage::new(gpu).unwrap();
        for is_flat in [false, true] {
            let scene = scene_of(&triangles, is_flat);
            let on_device = upload(gpu, &scene);
            let surfaces = on_device.surfaces();
            let near = View::near_plane(Vec3::ZERO, &surfaces);
            let one = vec![View::of_camera(&scene.cameras[0], &surfaces, area).unwrap()];
            let faces: Vec<_> = (0..6)
                .map(|face| View::of_cube_face(Vec3::ZERO, face, near, area).unwrap())
                .collect();
            let octants = View::of_octants(Vec3::ZERO, OctahedronLayout::Quadratic, near, area).unwrap();
            for views in [one, faces, octants] {
                let found = coverage.blocks(&surfaces, &views, SIZE).unwrap();
                assert_eq!(found.len(), 6);
                let of = |triangle: &[Vec3; 3]| -> f64 {
                    let corners = triangle.map(|corner| corner.as_dvec3());
                    let bounds = views.iter().map(|view| {
                        let bound = fragments(view, SIZE, corners);
                        if let Some(covered) = covered(view, corners) {
                            assert!(f64::from(covered) <= bound + 1e-6, "{covered} of {bound}: {triangle:?}");
                        }
                        bound
                    });
                    bounds.sum()
                };
                for (block, found) in triangles.chunks(BLOCK).zip(found) {
                    let expected: f64 = block.iter().map(of).sum();
                    // Places in f32, where a corner close to the plane of the eye is far outside.
                    let error = (f64::from(found) - expected).abs();
                    assert!(error <= 1e-3 * expected, "{found} instead of {expected}");
                }
            }
        }
    });
}
