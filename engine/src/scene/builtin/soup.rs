//! Random triangles: the adversary of spatial indexes.

use glam::{DVec3, Vec3};

use super::Entry;
use super::noise::unit;
use super::parameters::{Parameter, Values};
use crate::Result;
use crate::scene::{Camera, Environment, Material, Mesh, Scene};

pub const TRIANGLE_SOUP: Entry = Entry {
    name: "triangle-soup",
    summary: "Random triangles in a cube under a uniform sky, with a share of slivers.",
    parameters: &[
        Parameter::integer("n", "1000", 1, 4_000_000, "triangles"),
        Parameter::integer("seed", "1", 0, u32::MAX, "seed"),
        Parameter::real("extent", "2", 1e-3, 1e6, "side of the cube of centres, m"),
        Parameter::real("size", "0.1", 1e-6, 10.0, "edge length relative to the extent"),
        Parameter::real(
            "slivers",
            "0.1",
            0.0,
            1.0,
            "share of triangles that are 10,000 times longer than wide",
        ),
        Parameter::real(
            "offset",
            "0",
            -1e6,
            1e6,
            "distance of the cube from the origin along each axis, m",
        ),
    ],
    build,
};

/// Width of a sliver relative to its length.
const SLIVER_ASPECT: f32 = 1e-4;

fn build(values: &Values) -> Result<Scene> {
    let n = values.integer("n")?;
    let seed = values.integer("seed")?;
    let extent = values.real("extent")? as f32;
    let edge = values.real("size")? as f32 * extent;
    let slivers = values.real("slivers")? as f32;
    let offset = Vec3::splat(values.real("offset")? as f32);
    let mut scene = Scene::default();
    let material = scene.add_material(Material::lambert("grey", Vec3::splat(0.6)));
    let mut mesh = Mesh {
        name: "soup".into(),
        material: Some(material),
        ..Mesh::default()
    };
    for item in 0..n {
        let point = |dimension: u32| {
            Vec3::new(
                unit(seed, item, dimension) - 0.5,
                unit(seed, item, dimension + 1) - 0.5,
                unit(seed, item, dimension + 2) - 0.5,
            )
        };
        let a = offset + point(0) * extent;
        let b = a + point(3) * (2.0 * edge);
        let mut c = a + point(6) * (2.0 * edge);
        if unit(seed, item, 9) < slivers {
            c = a.midpoint(b) + (c - a) * SLIVER_ASPECT;
        }
        mesh.positions.extend([a, b, c]);
        mesh.triangles.push([3 * item, 3 * item + 1, 3 * item + 2]);
    }
    scene.place(mesh);
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    let centre = offset.as_dvec3();
    scene.cameras.push(Camera::look_at(
        "main",
        centre + DVec3::new(0.4, 0.5, 2.0) * f64::from(extent),
        centre,
        DVec3::Y,
        40f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;

    #[test]
    fn the_seed_decides_and_slivers_are_thin() {
        let soup = |query: &str| {
            generate(&format!("builtin:triangle-soup?{query}"))
                .expect("scene")
                .meshes
                .remove(0)
        };
        assert_eq!(soup("n=50&seed=3").positions, soup("n=50&seed=3").positions);
        assert_ne!(soup("n=50&seed=3").positions, soup("n=50&seed=4").positions);
        // The first triangles do not depend on how many follow.
        assert_eq!(soup("n=50").positions[..], soup("n=90").positions[..150]);
        let thin = soup("n=200&slivers=1");
        for t in &thin.triangles {
            let [a, b, c] = t.map(|i| thin.positions[i as usize].as_dvec3());
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            // Twice the area over the longest edge is the height; f32 corners of size 1 add 1e-7.
            let height = (b - a).cross(c - a).length() / longest;
            assert!(height < 1e-3, "{height}");
        }
    }
}
