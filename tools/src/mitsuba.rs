//! Export to Mitsuba 3, the independent renderer that reference pictures are checked against.
//!
//! A scene becomes `scene.xml` with binary PLY meshes in world space. Only what Mitsuba models in exactly the same way is written; everything else
//! is refused with material and reason, so that two converged pictures may differ by noise alone. Conventions, from Mitsuba's plugin documentation
//! and checked by experiment: a camera looks along +Z with +X to its left (ours: −Z, right); an environment map's texels are nodes in
//! elevation and cells in azimuth, with the seam half a turn away from ours.
//! Guarantees: deterministic files; no file is written for a scene that is refused.

mod medium;
pub(crate) mod mesh;
pub mod scenes;
pub(crate) mod surface;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clerestory::atomic;
use clerestory::film::{Picture, exr};
use clerestory::scene::{Camera, Environment, LightKind, Projection, Scene};
use clerestory::{Error, Result};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

/// What an export may take for granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExportOptions {
    /// Write interpolated shading normals. Renderers treat directions between shading and true normal differently, so by default only
    /// flat-shaded meshes are exported; smooth ones converge to pictures that differ slightly.
    pub shading_normals: bool,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The scene file.
    pub scene: PathBuf,
    /// The meshes, the environment map and the grids of media.
    pub files: Vec<PathBuf>,
    /// Triangles in all meshes; those without area are left out.
    pub triangles: usize,
    /// What our side must be set to for an exact match, one sentence each.
    pub notes: Vec<String>,
}

/// Exports a scene as seen by a camera (`""`: the first), `size` pixels, into the folder `dir`, which is made if need be.
///
/// # Errors
/// [`Error::Unsupported`] with every reason when Mitsuba cannot model the scene exactly; [`Error::Setting`] for a camera or size that does not exist;
/// [`Error::Io`] when a file cannot be written.
pub fn export(scene: &Scene, camera: &str, size: [u32; 2], dir: &Path) -> Result<Exported> {
    export_with(scene, camera, size, dir, ExportOptions::default())
}

/// [`export`] with options.
///
/// # Errors
/// As [`export`].
pub fn export_with(
    scene: &Scene,
    camera: &str,
    size: [u32; 2],
    dir: &Path,
    options: ExportOptions,
) -> Result<Exported> {
    if size.contains(&0) {
        return Err(Error::Setting {
            name: "size".into(),
            value: format!("{}x{}", size[0], size[1]),
            cause: "has no pixels".into(),
        });
    }
    let camera = find_camera(scene, camera)?;
    let mut reasons = Vec::new();
    let mut notes = Vec::new();
    let mut shapes = Vec::new();
    for instance in &scene.instances {
        match mesh::world_mesh(scene, instance, options.shading_normals) {
            Ok(world) => shapes.push(world),
            Err(reason) => reasons.push(reason),
        }
    }
    shapes.retain(|shape| !shape.triangles.is_empty());
    let surroundings = medium::Surroundings::new(scene, &shapes);
    reasons.extend(surroundings.refusals());
    let mut body = String::new();
    let mut grids = Vec::new();
    for (index, medium) in (0..).zip(&scene.media) {
        match medium::describe(index, medium) {
            Ok(described) => {
                body.push_str(&described.xml);
                grids.extend(described.file);
            }
            Err(cause) => reasons.push(format!("medium {:?}: {cause}", medium.name)),
        }
    }
    for (index, shape) in shapes.iter().enumerate() {
        match surface::describe(&shape.material, &mut notes) {
            Ok(surface) => {
                let file = mesh_file(index);
                let _ = writeln!(
                    body,
                    "  <shape type=\"ply\">\n    <string name=\"filename\" value=\"{file}\"/>"
                );
                let _ = writeln!(
                    body,
                    "    <boolean name=\"face_normals\" value=\"{}\"/>",
                    shape.normals.is_empty()
                );
                let _ = writeln!(body, "{surface}{}  </shape>", surroundings.of(shape));
            }
            Err(cause) => reasons.push(format!("material {:?}: {cause}", shape.material.name)),
        }
    }
    for light in &scene.lights {
        match light_xml(&light.kind, &surroundings) {
            Ok(xml) => body.push_str(&xml),
            Err(cause) => reasons.push(format!("light {:?}: {cause}", light.name)),
        }
    }
    let mut map = None;
    if let Some(environment) = &scene.environment {
        match environment_xml(environment) {
            Ok((xml, picture)) => {
                body.push_str(&xml);
                map = picture;
            }
            Err(cause) => reasons.push(format!("environment {:?}: {cause}", environment.name)),
        }
    }
    if !reasons.is_empty() {
        reasons.sort();
        reasons.dedup();
        return Err(Error::Unsupported {
            technique: "mitsuba-export".into(),
            reasons,
        });
    }

    std::fs::create_dir_all(dir).map_err(|cause| Error::io(dir, cause))?;
    let mut files = Vec::new();
    let write = |path: PathBuf, bytes: &[u8]| atomic::write(&path, bytes).map(|()| path);
    for (index, shape) in shapes.iter().enumerate() {
        files.push(write(dir.join(mesh_file(index)), &mesh::to_ply(shape))?);
    }
    if let Some(map) = map {
        let path = dir.join(ENVIRONMENT_FILE);
        exr::write(&path, &map)?;
        files.push(path);
    }
    for (name, bytes) in grids {
        files.push(write(dir.join(name), &bytes)?);
    }
    let reach = farthest(camera.transform.translation, &shapes);
    let around = medium_at(&surroundings, camera.transform.translation);
    let integrator = if scene.media.is_empty() { "path" } else { "volpathmis" };
    let text = format!(
        "{HEADER}  <integrator type=\"{integrator}\">{INTEGRATOR}{body}{}</scene>\n",
        camera_xml(camera, size, reach, &around)
    );
    notes.sort();
    notes.dedup();
    Ok(Exported {
        scene: write(dir.join("scene.xml"), text.as_bytes())?,
        files,
        triangles: shapes.iter().map(|shape| shape.triangles.len()).sum(),
        notes,
    })
}

const HEADER: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
  <default name="spp" value="16"/>
  <default name="sampler" value="independent"/>
"#;
const INTEGRATOR: &str = r#"
    <integer name="max_depth" value="-1"/>
    <integer name="rr_depth" value="5"/>
  </integrator>
"#;

const ENVIRONMENT_FILE: &str = "environment.exr";

fn mesh_file(index: usize) -> String {
    format!("mesh_{index:04}.ply")
}

pub(crate) fn find_camera<'a>(scene: &'a Scene, name: &str) -> Result<&'a Camera> {
    let found = if name.is_empty() {
        scene.cameras.first()
    } else {
        scene.cameras.iter().find(|camera| camera.name == name)
    };
    found.ok_or_else(|| Error::Setting {
        name: "camera".into(),
        value: format!("{name:?}"),
        cause: format!(
            "is not in the scene; there is: {:?}",
            scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>()
        ),
    })
}

/// Distance from `eye` to the farthest vertex.
fn farthest(eye: DVec3, shapes: &[mesh::WorldMesh]) -> f64 {
    let positions = shapes.iter().flat_map(|shape| &shape.positions);
    positions.map(|p| p.as_dvec3().distance(eye)).fold(0.0, f64::max)
}

/// `<rgb>` element.
fn rgb(name: &str, value: Vec3) -> String {
    format!("<rgb name=\"{name}\" value=\"{} {} {}\"/>", value.x, value.y, value.z)
}

/// `<transform>` element from an affine map.
fn transform_xml(indent: &str, transform: DAffine3) -> String {
    let (m, t) = (transform.matrix3, transform.translation);
    // Adding zero turns −0 into 0.
    let row = |i: usize| {
        format!(
            "{} {} {} {}",
            m.x_axis[i] + 0.0,
            m.y_axis[i] + 0.0,
            m.z_axis[i] + 0.0,
            t[i] + 0.0
        )
    };
    let rows = format!("{} {} {} 0 0 0 1", row(0), row(1), row(2));
    format!("{indent}<transform name=\"to_world\"><matrix value=\"{rows}\"/></transform>\n")
}

/// The sensor, in a medium if there is a `<ref>` to one: Mitsuba's camera space is ours turned half a turn about +Y.
fn camera_xml(camera: &Camera, size: [u32; 2], reach: f64, medium: &str) -> String {
    const NEAR_OVER_FAR: f64 = 1e-5;
    let half_turn = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0));
    let mut to_world = camera.transform * DAffine3::from_mat3(half_turn);
    let lens = camera.lens_radius > 0.0;
    let (kind, lines) = match camera.projection {
        Projection::Perspective { fov_y } => {
            let mut lines = format!(
                "    <string name=\"fov_axis\" value=\"y\"/>\n    <float name=\"fov\" value=\"{}\"/>\n",
                f64::from(fov_y).to_degrees()
            );
            if lens {
                let _ = writeln!(
                    lines,
                    "    <float name=\"aperture_radius\" value=\"{}\"/>",
                    camera.lens_radius
                );
                let _ = writeln!(
                    lines,
                    "    <float name=\"focus_distance\" value=\"{}\"/>",
                    camera.focus_distance
                );
            }
            (if lens { "thinlens" } else { "perspective" }, lines)
        }
        Projection::Orthographic { half_height } => {
            // Mitsuba sees [−1, 1] across the picture's width.
            let half_width = f64::from(half_height) * f64::from(size[0]) / f64::from(size[1]);
            to_world *= DAffine3::from_scale(DVec3::new(half_width, half_width, 1.0));
            ("orthographic", String::new())
        }
    };
    let far = 2.0 * reach + 1.0;
    format!(
        "  <sensor type=\"{kind}\">{medium}\n{lines}    <float name=\"near_clip\" value=\"{}\"/>\n    <float name=\"far_clip\" value=\"{far}\"/>\n{}\
         \x20   <sampler type=\"$sampler\"><integer name=\"sample_count\" value=\"$spp\"/></sampler>\n\
         \x20   <film type=\"hdrfilm\">\n\
         \x20     <integer name=\"width\" value=\"{}\"/>\n      <integer name=\"height\" value=\"{}\"/>\n\
         \x20     <string name=\"pixel_format\" value=\"rgb\"/>\n      <string name=\"component_format\" value=\"float32\"/>\n\
         \x20     <rfilter type=\"box\"/>\n    </film>\n  </sensor>\n",
        far * NEAR_OVER_FAR,
        transform_xml("    ", to_world),
        size[0],
        size[1],
    )
}

/// The `<ref>` to the medium around a camera or a light.
fn medium_at(surroundings: &medium::Surroundings, point: DVec3) -> String {
    let found = surroundings.at(point);
    found.map_or_else(String::new, |index| medium::reference("medium", index))
}

fn light_xml(light: &LightKind, surroundings: &medium::Surroundings) -> Result<String, String> {
    let vector = |kind: &str, name: &str, v: Vec3| {
        format!("<{kind} name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>", v.x, v.y, v.z)
    };
    match *light {
        LightKind::Point { position, intensity } => Ok(format!(
            "  <emitter type=\"point\">{}{}{}</emitter>\n",
            vector("point", "position", position),
            rgb("intensity", intensity),
            medium_at(surroundings, position.as_dvec3())
        )),
        LightKind::Directional { direction, irradiance } => Ok(format!(
            "  <emitter type=\"directional\">{}{}</emitter>\n",
            vector("vector", "direction", direction),
            rgb("irradiance", irradiance)
        )),
        LightKind::Spot { .. } => Err("a spot light's falloff in glTF is not Mitsuba's".into()),
    }
}

/// The emitter, and the map's file when it is not one colour.
///
/// Ours is bilinear between texel centres and constant beyond the first and last row's. Mitsuba's rows are nodes from pole to pole, so
/// 2 · height + 1 rows hold ours exactly: every texel centre and every pole is a node.
fn environment_xml(environment: &Environment) -> Result<(String, Option<Picture>), String> {
    let (width, height) = (environment.width as usize, environment.height as usize);
    let texels: Vec<Vec3> = environment.radiance.iter().map(|v| *v * environment.strength).collect();
    let sound = texels.iter().all(|v| v.is_finite() && v.min_element() >= 0.0);
    if texels.is_empty() || texels.len() != width * height || !sound {
        return Err("holds no texels, too few, or such as are negative or not finite".into());
    }
    if texels.iter().all(|texel| *texel == texels[0]) {
        let xml = format!(
            "  <emitter type=\"constant\">{}</emitter>\n",
            rgb("radiance", texels[0])
        );
        return Ok((xml, None));
    }
    let mut values = Vec::new();
    for node in 0..=2 * height {
        // Node j lies at elevation j/2 in units of our rows, whose centres are at halves.
        let above = (node.max(1) - 1) / 2;
        let (above, below) = (above.min(height - 1), (node / 2).min(height - 1));
        for column in 0..width {
            let mean = (texels[above * width + column] + texels[below * width + column]) / 2.0;
            values.extend(mean.to_array());
        }
    }
    let rows = 2 * environment.height + 1;
    let picture = Picture::from_radiance(environment.width, rows, values).map_err(|e| e.to_string())?;
    let rotation = environment.rotation.as_dquat() * DQuat::from_rotation_y(std::f64::consts::PI);
    let xml = format!(
        "  <emitter type=\"envmap\">\n    <string name=\"filename\" value=\"{ENVIRONMENT_FILE}\"/>\n{}  </emitter>\n",
        transform_xml("    ", DAffine3::from_quat(rotation))
    );
    Ok((xml, Some(picture)))
}

#[cfg(test)]
mod tests;
