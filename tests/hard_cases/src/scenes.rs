//! Scenes whose picture is known, and the parts that they are made of.

use clerestory::Result;
use clerestory::scene::{
    Camera, DensityGrid, Environment, LightKind, Material, Medium, Mesh, Phase, Projection, Scene, load,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::random::Random;

/// Size of most pictures.
pub const SMALL: [u32; 2] = [16, 16];

/// A closed 2 m room of radiance 1 everywhere.
///
/// # Errors
/// None; the address is right.
pub fn furnace() -> Result<Scene> {
    load("builtin:furnace-box?rho=0.5&emission=0.5")
}

/// Moves and scales everything that is placed: instances and the cameras' places.
pub fn transform(scene: &mut Scene, by: DAffine3) {
    for instance in &mut scene.instances {
        instance.transform = by * instance.transform;
    }
    for camera in &mut scene.cameras {
        camera.transform.translation = by.transform_point3(camera.transform.translation);
    }
}

/// A camera that looks straight down (−Y) at a square of the plane y = 0, from `height`.
pub fn camera_down(half_height: f32, height: f64) -> Camera {
    orthographic(DVec3::Y * height, DVec3::ZERO, -DVec3::Z, half_height)
}

/// An orthographic camera.
pub fn orthographic(eye: DVec3, target: DVec3, up: DVec3, half_height: f32) -> Camera {
    let mut camera = Camera::look_at("main", eye, target, up, 1.0);
    camera.projection = Projection::Orthographic { half_height };
    camera
}

/// The square [−half, half]² of the plane at `y`, facing up.
pub fn floor(name: &str, material: u32, half: f32, y: f32) -> Mesh {
    let corner = |x: f32, z: f32| Vec3::new(x * half, y, z * half);
    Mesh {
        name: name.into(),
        positions: vec![
            corner(-1.0, 1.0),
            corner(1.0, 1.0),
            corner(1.0, -1.0),
            corner(-1.0, -1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A medium of extinction σ and albedo c.
pub fn medium(sigma_t: f32, albedo: f32, phase: Phase) -> Medium {
    Medium {
        name: "medium".into(),
        sigma_a: Vec3::splat(sigma_t * (1.0 - albedo)),
        sigma_s: Vec3::splat(sigma_t * albedo),
        phase,
        ..Medium::default()
    }
}

/// Two triangles between corners that follow each other.
pub fn quad(name: &str, material: u32, corners: [Vec3; 4]) -> Mesh {
    Mesh {
        name: name.into(),
        positions: corners.into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A closed box, seen from outside counter-clockwise.
pub fn cuboid(name: &str, material: u32, lower: Vec3, upper: Vec3) -> Mesh {
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), upper, lower);
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        name: name.into(),
        positions: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        material: Some(material),
        ..Mesh::default()
    }
}

/// A triangle without area at `place`, of a material: it is never met, but the scene's profile has to count its material in.
pub fn point_triangle(scene: &mut Scene, material: Material, place: Vec3) {
    let material = scene.add_material(material);
    scene.place(Mesh {
        name: "no area".into(),
        positions: vec![place; 3],
        triangles: vec![[0, 1, 2]],
        material: Some(material),
        ..Mesh::default()
    });
}

/// Places a grid of 32³ cells in the unit cube, one in each block of 4³ as dense as this in m⁻¹ and the others empty, and a point light above it. A path makes as many
/// tentative collisions as if all were dense, and next to none of them is real.
pub fn place_sparse_grid(scene: &mut Scene, density: f32) {
    let dense = |place: f64| (place * 32.0) as u32 % 4 == 1;
    let cells = DensityGrid::from_fn([32; 3], |p| {
        let full = dense(p.x) && dense(p.y) && dense(p.z);
        if full { density } else { 0.0 }
    });
    let inside = scene.media.len() as u32;
    scene.media.push(Medium {
        name: "sparse".into(),
        sigma_a: Vec3::splat(0.5),
        sigma_s: Vec3::splat(0.5),
        density: Some(cells.in_box(DVec3::ZERO, DVec3::ONE)),
        ..Medium::default()
    });
    let boundary = scene.add_material(Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(inside),
        ..Material::default()
    });
    scene.place(cuboid("grid", boundary, Vec3::ZERO, Vec3::ONE));
    let (position, intensity) = (Vec3::new(0.4, 1.5, 0.6), Vec3::ONE);
    scene.add_light("point", LightKind::Point { position, intensity });
}

/// Densities of the cells of a grid that is one cell wide, from below to above.
#[derive(Debug, Clone)]
pub struct DensityProfile {
    /// What it is, in words.
    pub name: &'static str,
    /// Density of each cell, by which a medium's cross sections are multiplied.
    pub values: Vec<f32>,
}

/// Extinctions of the bands at a density of 1, 1/m, of [`floor_under`].
pub const PROFILE_SIGMA: [f32; 3] = [0.5, 1.0, 2.0];
/// Faces of a profile's grid above the floor, m, a metre apart.
pub const PROFILE_FACES: [f64; 2] = [0.5, 1.5];

/// Waves that fill blocks of the bound unevenly; one dense cell of twelve; a layer thinner than the places of a table of transmittances are apart, and midway between
/// two of these.
pub fn density_profiles() -> [DensityProfile; 3] {
    let waves = (0..12).map(|i| 1.0 + 0.9 * (7.0 * (f64::from(i) + 0.5) / 12.0).sin() as f32);
    let dense = |cells: usize, at: usize, background: f32, density: f32| {
        let mut values = vec![background; cells];
        values[at] = density;
        values
    };
    let profile = |name, values| DensityProfile { name, values };
    [
        profile("waves", waves.collect()),
        profile("one dense cell of twelve", dense(12, 5, 0.1, 9.0)),
        profile("a layer of a 512th", dense(1024, 512, 1.0, 1024.0)),
    ]
}

/// The grid of a profile over what is seen of a floor, or so far aside.
pub fn profile_grid(profile: &DensityProfile, aside: f64) -> DensityGrid {
    let grid = DensityGrid {
        size: [1, profile.values.len() as u32, 1],
        values: profile.values.clone(),
        to_world: DAffine3::IDENTITY,
    };
    let [low, high] = PROFILE_FACES;
    grid.in_box(DVec3::new(aside - 1.0, low, -1.0), DVec3::new(aside + 1.0, high, 1.0))
}

/// A floor that a light beneath the grid of a profile lights, seen from straight above through the grid, or beside it where that is far enough aside. The grid only
/// absorbs.
pub fn floor_under(profile: &DensityProfile, aside: f64) -> Scene {
    let mut scene = Scene {
        name: "floor under a grid".into(),
        ..Scene::default()
    };
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, 1.5, 0.0));
    scene.media.push(Medium {
        sigma_a: Vec3::from_array(PROFILE_SIGMA),
        density: Some(profile_grid(profile, aside)),
        ..Medium::default()
    });
    scene.surrounding = Some(0);
    scene.cameras.push(camera_down(0.3, 5.0));
    let (position, intensity) = (Vec3::new(0.5, 0.3, 0.4), Vec3::ONE);
    scene.add_light("light", LightKind::Point { position, intensity });
    scene
}

/// Equal triangles, which no index can part, before a floor under a uniform sky: a ray that crosses their box beside them meets none, and tests all.
pub fn equal_triangles(count: usize) -> Scene {
    let mut scene = Scene {
        name: "equal triangles".into(),
        environment: Some(Environment::uniform(Vec3::ONE)),
        ..Scene::default()
    };
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.place(Mesh {
        name: "triangles".into(),
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(0.0, 1.0, 0.0),
        ],
        triangles: vec![[0, 1, 2]; count],
        material: Some(grey),
        ..Mesh::default()
    });
    let (low, high) = (Vec3::new(-2.0, -2.0, -1.1), Vec3::new(2.0, 2.0, -1.0));
    scene.place(cuboid("floor", grey, low, high));
    let eye = DVec3::new(0.0, 0.0, 3.0);
    scene
        .cameras
        .push(Camera::look_at("main", eye, DVec3::ZERO, DVec3::Y, 0.8));
    scene
}

/// A floor of a material seen from straight above over 2 m × 2 m; nothing shines.
pub fn floor_from_above(material: Material) -> Scene {
    let mut scene = Scene {
        name: "floor".into(),
        ..Scene::default()
    };
    let material = scene.add_material(material);
    scene.place(floor("floor", material, 4.0, 0.0));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

/// A surface that shines with this radiance, on both sides, and reflects nothing.
pub fn lamp(radiance: Vec3) -> Material {
    Material {
        emission: radiance,
        ..Material::lambert("lamp", Vec3::ZERO)
    }
}

/// A sphere of a material in a uniform environment of radiance 1. Materials of other kinds stand by without area, so that all such scenes
/// share their kernels.
///
/// # Errors
/// None; the address is right.
pub fn white_furnace(material: Material) -> Result<Scene> {
    let mut scene = load("builtin:white-furnace?frequency=4&smooth=yes")?;
    scene.materials[0] = material;
    add_palette(&mut scene);
    Ok(scene)
}

/// A floor of a material in a uniform environment of radiance 1, seen by an orthographic camera at an elevation above the horizon; with
/// the materials of [`white_furnace`] standing by.
pub fn floor_in_furnace(material: Material, elevation: f64, half_height: f32) -> Scene {
    let mut scene = floor_from_above(material);
    scene.meshes[0] = floor("floor", 0, 1000.0, 0.0);
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    let eye = DVec3::new(elevation.cos(), elevation.sin(), 0.0) * 100.0;
    scene.cameras = vec![orthographic(eye, DVec3::ZERO, DVec3::Z, half_height)];
    add_palette(&mut scene);
    scene
}

/// Adds materials of all kinds without area, and a mesh with normals.
fn add_palette(scene: &mut Scene) {
    let coated = Material {
        metallic: 0.0,
        roughness: 0.5,
        ..Material::default()
    };
    let ink = Material {
        roughness: 0.5,
        attenuation_color: Vec3::splat(0.5),
        attenuation_distance: 1.0,
        ..Material::glass("ink", 1.5)
    };
    let thin = Material {
        thickness: 0.0,
        ..Material::glass("thin", 1.5)
    };
    for material in [coated, Material::default(), ink, thin] {
        point_triangle(scene, material, Vec3::ZERO);
    }
    if let Some(mesh) = scene.meshes.last_mut() {
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
    }
}

/// Averages of a function of (x, z) over each pixel of a square picture of [−half, half]² seen by [`camera_down`], by a midpoint rule of
/// `steps` × `steps` points per pixel.
pub fn pixel_averages(size: u32, half: f64, steps: u32, function: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let at = |i: u32, sub: u32| {
        half * (2.0 * (f64::from(i) + (f64::from(sub) + 0.5) / f64::from(steps)) / f64::from(size) - 1.0)
    };
    (0..size * size)
        .map(|pixel| {
            let sum: f64 = (0..steps * steps)
                .map(|s| function(at(pixel % size, s % steps), at(pixel / size, s / steps)))
                .sum();
            sum / f64::from(steps * steps)
        })
        .collect()
}

/// Triangles at random places within 1 m of the origin, edges of up to `size`.
pub fn soup(seed: u64, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let mut random = Random(seed);
    let mut triangle = || {
        let centre = random.vector();
        [0; 3].map(|_| centre + size * random.vector())
    };
    (0..count).map(|_| triangle()).collect()
}

/// Cells of 1 m of three planes across z and three across x, on integer coordinates from −2 to 2.
pub fn lattice() -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for a in -2..2 {
        for b in -2..2 {
            let (a, b) = (a as f32, b as f32);
            for k in [-1.0, 0.0, 2.0] {
                let corner = |i: f32, j: f32| Vec3::new(a + i, b + j, k);
                let lower = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)];
                triangles.push(lower);
                triangles.push([corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
                triangles.push(lower.map(|p| Vec3::new(p.z, p.x, p.y)));
            }
        }
    }
    triangles
}
