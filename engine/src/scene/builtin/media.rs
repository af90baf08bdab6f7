//! Bodies that hold a medium: a plane-parallel slab, a furnace in which they vanish, and wax.
//!
//! * Slab: the classical problem of radiative transfer (Chandrasekhar, "Radiative Transfer", 1960, chapter 3; van de Hulst, "Multiple Light
//!   Scattering", 1980, for tables of its reflectance and transmittance).
//! * Furnace: in a uniform environment, what absorbs nothing cannot be seen, however it scatters.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, geodesic_sphere};
use crate::Result;
use crate::scene::medium::generate::Generator;
use crate::scene::{Camera, Environment, LightKind, Material, Medium, Phase, Projection, Scene};

pub(super) const PHASE: Parameter = Parameter::choice(
    "phase",
    "hg",
    &["isotropic", "hg", "schlick", "rayleigh"],
    "phase function; g counts for hg and schlick",
);
pub(super) const G: Parameter = Parameter::real(
    "g",
    "0",
    -0.999,
    0.999,
    "mean cosine of hg, eccentricity of schlick; forward is positive",
);
const GREATEST_COEFFICIENT: f64 = 1e6;

/// Parameters of a medium that is not there by default.
pub(super) const ABSORPTION: Parameter = coefficient(
    "sigma_a",
    "0",
    "absorption coefficient of the air, 1/m; it is a medium where one of both coefficients is above 0",
);
pub(super) const SCATTERING: Parameter = coefficient("sigma_s", "0", "scattering coefficient of the air, 1/m");

/// A parameter in 1/m per band.
pub(super) const fn coefficient(name: &'static str, default: &'static str, meaning: &'static str) -> Parameter {
    Parameter::color(name, default, 0.0, GREATEST_COEFFICIENT, meaning)
}

pub(super) fn phase(values: &Values) -> Result<Phase> {
    let g = values.real("g")? as f32;
    Ok(match values.word("phase")? {
        "hg" => Phase::HenyeyGreenstein { g },
        "schlick" => Phase::Schlick { k: g },
        "rayleigh" => Phase::Rayleigh,
        _ => Phase::Isotropic,
    })
}

/// A medium without a grid from the parameters `sigma_a`, `sigma_s`, `phase` and `g`.
pub(super) fn medium(name: &str, values: &Values) -> Result<Medium> {
    Ok(Medium {
        name: name.into(),
        sigma_a: values.color("sigma_a")?,
        sigma_s: values.color("sigma_s")?,
        phase: phase(values)?,
        ..Medium::default()
    })
}

/// Adds a medium; returns its index.
pub(super) fn add_medium(scene: &mut Scene, medium: Medium) -> u32 {
    scene.media.push(medium);
    scene.media.len() as u32 - 1
}

/// Fills the space outside all bodies with the medium of the parameters; with nothing where they have no coefficient above 0.
pub(super) fn surround(scene: &mut Scene, name: &str, values: &Values) -> Result<()> {
    let medium = medium(name, values)?;
    if !medium.is_empty() {
        scene.surrounding = Some(add_medium(scene, medium));
    }
    Ok(())
}

/// Adds the material of an invisible boundary around a medium.
pub(super) fn add_boundary(scene: &mut Scene, medium: u32) -> u32 {
    scene.add_material(Material {
        interior: Some(medium),
        boundary: true,
        ..Material::lambert("boundary", Vec3::ZERO)
    })
}

pub const MEDIUM_SLAB: Entry = Entry {
    name: "medium-slab",
    summary: "A wide slab of a scattering medium in a uniform environment or a beam, seen straight on by an orthographic camera.",
    parameters: &[
        coefficient("sigma_a", "0", "absorption coefficient, 1/m"),
        coefficient("sigma_s", "1", "scattering coefficient, 1/m"),
        PHASE,
        G,
        Parameter::real("thickness", "1", 1e-3, 1e3, "thickness, m"),
        Parameter::real("width", "200", 1.0, 1e4, "side length in units of the thickness"),
        Parameter::choice(
            "source",
            "front",
            &["front", "back", "uniform"],
            "a beam from the camera's side or from behind, or a uniform environment",
        ),
        Parameter::real(
            "incidence",
            "0",
            0.0,
            89.0,
            "angle of the beam to the slab's normal, degrees",
        ),
        Parameter::real(
            "light",
            "1",
            0.0,
            1e6,
            "irradiance of the beam across itself, W/m², or radiance of the environment",
        ),
        Parameter::real(
            "view",
            "0",
            0.0,
            89.0,
            "angle of the camera to the slab's normal, degrees",
        ),
    ],
    build: medium_slab,
};

fn medium_slab(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let medium = add_medium(&mut scene, medium("slab", values)?);
    let material = add_boundary(&mut scene, medium);
    let thickness = values.real("thickness")?;
    let half = thickness * values.real("width")? / 2.0;
    let corner = DVec3::new(half, half, thickness / 2.0).as_vec3();
    scene.place(MeshBuilder::new("slab", material).cuboid(-corner, corner).build());
    let light = values.real("light")? as f32;
    let source = values.word("source")?;
    if source == "uniform" {
        scene.environment = Some(Environment::uniform(Vec3::splat(light)));
    } else {
        let angle = values.real("incidence")?.to_radians();
        let along = if source == "front" { -angle.cos() } else { angle.cos() };
        scene.add_light(
            "beam",
            LightKind::Directional {
                direction: DVec3::new(angle.sin(), 0.0, along).as_vec3().normalize(),
                irradiance: Vec3::splat(light),
            },
        );
    }
    let view = values.real("view")?.to_radians();
    let mut camera = Camera::look_at(
        "main",
        DVec3::new(view.sin(), 0.0, view.cos()) * thickness * 4.0,
        DVec3::ZERO,
        DVec3::Y,
        0.5,
    );
    camera.projection = Projection::Orthographic {
        half_height: (thickness / 2.0) as f32,
    };
    scene.cameras.push(camera);
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

pub const FURNACE_MEDIUM: Entry = Entry {
    name: "furnace-medium",
    summary: "A body of a medium in a uniform environment of radiance 1: with nothing absorbed it vanishes.",
    parameters: &[
        coefficient("sigma_a", "0", "absorption coefficient, 1/m"),
        coefficient("sigma_s", "2", "scattering coefficient, 1/m"),
        PHASE,
        G,
        Parameter::choice(
            "shape",
            "sphere",
            &["sphere", "box"],
            "a sphere of radius 1 m, or a box of 2 m per side",
        ),
        Parameter::choice(
            "density",
            "constant",
            &["constant", "gradient", "ball", "smoke", "cloud"],
            "even, or a grid of 24 cells per side over the box around the body",
        ),
        Parameter::real("ior", "1", 1.0, 4.0, "index of refraction; 1 is an invisible boundary"),
        Parameter::real(
            "roughness",
            "0",
            0.0,
            1.0,
            "perceptual roughness of the surface for ior above 1",
        ),
        Parameter::real("environment", "1", 0.0, 1e6, "radiance of the environment, W·m⁻²·sr⁻¹"),
        Parameter::integer(
            "frequency",
            "16",
            1,
            128,
            "cuts of each icosahedron edge: 20·frequency² triangles",
        ),
    ],
    build: furnace_medium,
};

/// A rough or smooth solid with a medium inside, or an invisible boundary for index 1.
fn add_solid(scene: &mut Scene, name: &str, ior: f32, roughness: f32, medium: u32) -> u32 {
    if ior == 1.0 {
        return add_boundary(scene, medium);
    }
    scene.add_material(Material {
        roughness,
        interior: Some(medium),
        ..Material::glass(name, ior)
    })
}

fn furnace_medium(values: &Values) -> Result<Scene> {
    const CELLS: u32 = 24;
    let mut scene = Scene::default();
    let mut medium = medium("fog", values)?;
    let generator = Generator::by_name(values.word("density")?).filter(|g| *g != Generator::Constant);
    medium.density = generator.map(|g| g.grid([CELLS; 3], 1).in_box(DVec3::NEG_ONE, DVec3::ONE));
    let medium = add_medium(&mut scene, medium);
    let (ior, roughness) = (values.real("ior")? as f32, values.real("roughness")? as f32);
    let material = add_solid(&mut scene, "body", ior, roughness, medium);
    scene.place(if values.word("shape")? == "sphere" {
        geodesic_sphere("body", material, 1.0, values.integer("frequency")?, false)
    } else {
        MeshBuilder::new("body", material)
            .cuboid(Vec3::NEG_ONE, Vec3::ONE)
            .build()
    });
    scene.environment = Some(Environment::uniform(Vec3::splat(values.real("environment")? as f32)));
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(1.0, 1.5, 4.0),
        DVec3::ZERO,
        DVec3::Y,
        40f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "inside",
        DVec3::new(0.1, 0.2, 0.3),
        DVec3::new(-1.0, 0.1, -0.4),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

pub const WAX: Entry = Entry {
    name: "wax",
    summary: "A solid with a scattering inside on a white floor, lit from behind: light goes through where it is thin.",
    parameters: &[
        coefficient("sigma_a", "0.3,1.2,4", "absorption coefficient, 1/m"),
        coefficient("sigma_s", "60,60,60", "scattering coefficient, 1/m"),
        PHASE,
        G,
        Parameter::choice(
            "shape",
            "sphere",
            &["sphere", "box"],
            "a sphere of radius 0.1 m, or a box of that half side",
        ),
        Parameter::real(
            "ior",
            "1.45",
            1.0,
            4.0,
            "index of refraction; 1 is an invisible boundary",
        ),
        Parameter::real("roughness", "0.5", 0.0, 1.0, "perceptual roughness of the surface"),
        Parameter::color("light", "40", 0.0, 1e6, "radiance of the panel behind, W·m⁻²·sr⁻¹"),
        Parameter::real(
            "environment",
            "0.3",
            0.0,
            1e6,
            "radiance of the environment, W·m⁻²·sr⁻¹",
        ),
        Parameter::choice("smooth", "yes", &["yes", "no"], "interpolated normals of the sphere"),
    ],
    build: wax,
};

fn wax(values: &Values) -> Result<Scene> {
    const RADIUS: f32 = 0.1;
    const CLEARANCE: f32 = 0.002;
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(0.6)));
    let ground = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
    scene.place(MeshBuilder::new("floor", floor).quad(ground).build());
    let mut lamp = Material::lambert("light", Vec3::ZERO);
    lamp.emission = values.color("light")?;
    lamp.double_sided = false;
    let lamp = scene.add_material(lamp);
    // Behind to the left, turned towards the body.
    let middle = Vec3::new(-0.3, 0.6, -0.3);
    let towards = (Vec3::Y * RADIUS - middle).normalize();
    let (across, up) = towards.any_orthonormal_pair();
    let at = |x: f32, y: f32| middle + 0.08 * (across * x + up * y);
    let panel = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
    scene.place(MeshBuilder::new("light", lamp).quad(panel).build());
    let medium = add_medium(&mut scene, medium("wax", values)?);
    let (ior, roughness) = (values.real("ior")? as f32, values.real("roughness")? as f32);
    let material = add_solid(&mut scene, "wax", ior, roughness, medium);
    let centre = Vec3::Y * (RADIUS + CLEARANCE);
    scene.place(if values.word("shape")? == "sphere" {
        const FREQUENCY: u32 = 24;
        let ball = geodesic_sphere("", material, f64::from(RADIUS), FREQUENCY, values.yes("smooth")?);
        MeshBuilder::new("body", material).append(&ball, |p| p + centre).build()
    } else {
        let half = Vec3::splat(RADIUS);
        MeshBuilder::new("body", material)
            .cuboid(centre - half, centre + half)
            .build()
    });
    scene.environment = Some(Environment::uniform(Vec3::splat(values.real("environment")? as f32)));
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.25, 0.25, 0.55),
        DVec3::new(0.0, 0.09, 0.0),
        DVec3::Y,
        35f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn parameters_reach_the_medium_and_its_boundary() {
        let of = |address: &str| SceneProfile::of(&generate(&format!("builtin:{address}")).expect("scene")).media;
        let furnace = of("furnace-medium");
        assert!(furnace.boundaries && furnace.homogeneous && furnace.phases.isotropic && !furnace.absorbs);
        assert!(of("furnace-medium?density=ball").heterogeneous && of("furnace-medium?g=0.5").phases.henyey_greenstein);
        assert!(of("furnace-medium?ior=1.5").in_solids && !of("furnace-medium?ior=1.5").boundaries);
        assert!(of("wax").chromatic && of("wax").in_solids);
        assert!(
            of("medium-slab?phase=schlick&g=0.3").phases.schlick && of("medium-slab?phase=rayleigh").phases.rayleigh
        );
        assert_eq!(of("medium-slab?sigma_s=0").count, 0);
    }

    #[test]
    fn the_panel_of_the_wax_shines_on_it() {
        let scene = generate("builtin:wax").expect("scene");
        let panel = scene.meshes.iter().find(|m| m.name == "light").expect("panel");
        let [a, b, c] = panel.triangles[0].map(|i| panel.positions[i as usize]);
        let towards = glam::Vec3::Y * 0.1 - a;
        assert!((b - a).cross(c - a).dot(towards) > 0.0);
    }
}
