//! The node hierarchy: placements, cameras, lights and EXT_mesh_gpu_instancing ("glTF 2.0 Specification", §3.5, §3.10;
//! KHR_lights_punctual).

use ::gltf::json::accessor::Accessor;
use ::gltf::json::validation::Checked;
use ::gltf::json::{self, Index};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::Value;

use super::Reader;
use crate::scene::check::MAX_INSTANCES;
use crate::scene::{Camera, Instance, Light, LightKind, Projection};
use crate::{Error, Result};

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

impl Reader<'_> {
    /// Walks the default scene, depth first and in the file's order.
    pub fn load_nodes(&mut self) -> Result<()> {
        let roots: Vec<usize> = match (self.root.scene, self.root.scenes.first()) {
            (Some(index), _) => {
                let scene = self.get(&self.root.scenes, "scene", index.value(), "scene")?;
                scene.nodes.iter().map(Index::value).collect()
            }
            (None, Some(scene)) => {
                self.note("file without a default scene", "scene", "scenes[0] is used");
                scene.nodes.iter().map(Index::value).collect()
            }
            (None, None) => {
                self.note("file without scenes", "scenes", "all root nodes are used");
                let mut is_child = vec![false; self.root.nodes.len()];
                for child in self.root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                    if let Some(flag) = is_child.get_mut(child.value()) {
                        *flag = true;
                    }
                }
                (0..is_child.len()).filter(|&i| !is_child[i]).collect()
            }
        };
        if self.root.scenes.len() > 1 {
            self.note("several scenes", "scenes", "only the default scene is used");
        }
        let mut reached = vec![false; self.root.nodes.len()];
        let mut stack: Vec<(usize, DAffine3)> = roots.into_iter().rev().map(|i| (i, DAffine3::IDENTITY)).collect();
        while let Some((i, parent)) = stack.pop() {
            let node = self.get(&self.root.nodes, "node", i, "nodes")?;
            let at = format!("nodes[{i}]");
            // Also ends cycles.
            if std::mem::replace(&mut reached[i], true) {
                return self.fail(at, "is reached twice; a node may have one parent only");
            }
            let world = parent * self.local(node, &at)?;
            if !world.is_finite() {
                return self.fail(at, "has a world transform that is not finite");
            }
            self.node(node, world, &at)?;
            stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), world)));
        }
        Ok(())
    }

    fn local(&self, node: &json::Node, at: &str) -> Result<DAffine3> {
        let Some(matrix) = node.matrix else {
            let vector = |v: Option<[f32; 3]>, default: DVec3| v.map_or(default, |v| Vec3::from_array(v).as_dvec3());
            let rotation = node
                .rotation
                .map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(f64::from)));
            if rotation.length_squared() == 0.0 || !rotation.is_finite() {
                return self.fail(format!("{at}.rotation"), "is not a quaternion that can be normalized");
            }
            return Ok(DAffine3::from_scale_rotation_translation(
                vector(node.scale, DVec3::ONE),
                rotation.normalize(),
                vector(node.translation, DVec3::ZERO),
            ));
        };
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        if !matrix.is_finite() || matrix.row(3) != glam::DVec4::W {
            return self.fail(format!("{at}.matrix"), "is not finite and affine");
        }
        Ok(DAffine3::from_mat4(matrix))
    }

    fn node(&mut self, node: &json::Node, world: DAffine3, at: &str) -> Result<()> {
        let name = node.name.clone().unwrap_or_else(|| at.into());
        if node.skin.is_some() {
            self.note(
                "skinning",
                format!("{at}.skin"),
                "the mesh is placed by its node, as it is stored",
            );
        }
        let mut instancing = None;
        if let Some(extensions) = &node.extensions {
            instancing = extensions.others.get(INSTANCING);
            for other in extensions.others.keys().filter(|key| *key != INSTANCING) {
                self.note(other, format!("{at}.extensions"), "ignored");
            }
            if let Some(light) = &extensions.khr_lights_punctual {
                self.light(light.light.value(), world, &name, at)?;
            }
        }
        if let Some(mesh) = node.mesh {
            let meshes = self.mesh(mesh.value(), &format!("{at}.mesh"))?;
            let placements = match instancing {
                Some(value) => self.placements(value, &format!("{at}.extensions.{INSTANCING}"))?,
                None => vec![DAffine3::IDENTITY],
            };
            let total = self.scene.instances.len() as u64 + meshes.len() as u64 * placements.len() as u64;
            if total > MAX_INSTANCES as u64 {
                return self.fail(
                    at,
                    format!("brings the instances to {total}; at most {MAX_INSTANCES} are allowed"),
                );
            }
            // One is the node's own; the others cost the file nothing.
            let more = (meshes.len() * placements.len()).saturating_sub(1);
            self.reserve((more * (size_of::<Instance>() + name.len())) as u64, at)?;
            for placement in placements {
                for &mesh in &meshes {
                    self.scene.instances.push(Instance {
                        mesh,
                        transform: world * placement,
                        name: name.clone(),
                    });
                }
            }
        }
        if let Some(camera) = node.camera {
            self.camera(camera.value(), world, node.name.as_deref(), at)?;
        }
        Ok(())
    }

    /// The placements of EXT_mesh_gpu_instancing, in the node's space.
    fn placements(&mut self, extension: &Value, at: &str) -> Result<Vec<DAffine3>> {
        let at = format!("{at}.attributes");
        let Some(attributes) = extension.get("attributes").and_then(Value::as_object) else {
            return self.fail(at, "is missing");
        };
        let mut read = |name: &str, width: usize| -> Result<Option<Vec<f32>>> {
            let Some(value) = attributes.get(name) else {
                return Ok(None);
            };
            let at = format!("{at}.{name}");
            let Some(index) = value.as_u64().and_then(|i| u32::try_from(i).ok()) else {
                return self.fail(at, format!("{value} is not an accessor index"));
            };
            Ok(Some(self.floats(Index::<Accessor>::new(index), &[width], &at)?.values))
        };
        let translations = read("TRANSLATION", 3)?;
        let rotations = read("ROTATION", 4)?;
        let scales = read("SCALE", 3)?;
        let counts = [
            translations.as_ref().map(|v| v.len() / 3),
            rotations.as_ref().map(|v| v.len() / 4),
            scales.as_ref().map(|v| v.len() / 3),
        ];
        let Some(count) = counts.iter().flatten().next().copied() else {
            return self.fail(at, "has none of TRANSLATION, ROTATION and SCALE");
        };
        if counts.iter().flatten().any(|&other| other != count) {
            return self.fail(at, "have different counts");
        }
        if count > MAX_INSTANCES {
            return self.fail(
                at,
                format!("place {count} instances; at most {MAX_INSTANCES} are allowed"),
            );
        }
        let vector = |values: &Option<Vec<f32>>, i: usize, default: DVec3| {
            values
                .as_ref()
                .map_or(default, |v| Vec3::from_slice(&v[3 * i..3 * i + 3]).as_dvec3())
        };
        let memory = (count * size_of::<DAffine3>()) as u64;
        self.files
            .reserve(memory, 0)
            .map_err(|cause| Error::scene(self.source, &at, cause))?;
        let mut placements = Vec::with_capacity(count);
        for i in 0..count {
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |v| {
                DQuat::from_xyzw(
                    v[4 * i].into(),
                    v[4 * i + 1].into(),
                    v[4 * i + 2].into(),
                    v[4 * i + 3].into(),
                )
            });
            let scale = vector(&scales, i, DVec3::ONE);
            let translation = vector(&translations, i, DVec3::ZERO);
            let finite = rotation.is_finite() && scale.is_finite() && translation.is_finite();
            if !finite || rotation.length_squared() == 0.0 {
                return self.fail(at, format!("instance {i} is not finite or has no rotation"));
            }
            placements.push(DAffine3::from_scale_rotation_translation(
                scale,
                rotation.normalize(),
                translation,
            ));
        }
        Ok(placements)
    }

    fn camera(&mut self, i: usize, world: DAffine3, node: Option<&str>, at: &str) -> Result<()> {
        let camera = self.get(&self.root.cameras, "camera", i, &format!("{at}.camera"))?;
        let place = format!("cameras[{i}]");
        let (projection, aspect) = match (&camera.type_, &camera.perspective, &camera.orthographic) {
            (Checked::Valid(json::camera::Type::Perspective), Some(p), _) => {
                (Projection::Perspective { fov_y: p.yfov }, p.aspect_ratio)
            }
            (Checked::Valid(json::camera::Type::Orthographic), _, Some(o)) => {
                (Projection::Orthographic { half_height: o.ymag }, Some(o.xmag / o.ymag))
            }
            _ => return self.fail(place, "has a type without its description"),
        };
        let Some(rotation) = rotation_of(world) else {
            return self.fail(at, "gives its camera no direction");
        };
        let usable = |aspect: &f32| aspect.is_finite() && *aspect > 0.0;
        if self.scene.cameras.is_empty() {
            self.scene.defaults.aspect = aspect.filter(usable);
        }
        let name = node.or(camera.name.as_deref()).unwrap_or(&place);
        self.reserve(name.len() as u64, at)?;
        self.scene.cameras.push(Camera {
            name: name.into(),
            transform: DAffine3::from_mat3_translation(rotation, world.translation),
            projection,
            lens_radius: 0.0,
            focus_distance: 1.0,
        });
        Ok(())
    }

    fn light(&mut self, i: usize, world: DAffine3, node: &str, at: &str) -> Result<()> {
        use json::extensions::scene::khr_lights_punctual::Type;
        let extensions = self.root.extensions.as_ref();
        let lights = extensions
            .and_then(|e| e.khr_lights_punctual.as_ref())
            .map_or(&[][..], |l| &l.lights);
        let place = format!("extensions.KHR_lights_punctual.lights[{i}]");
        let light = self.get(
            lights,
            "light",
            i,
            &format!("{at}.extensions.KHR_lights_punctual.light"),
        )?;
        let strength = Vec3::from_array(light.color) * light.intensity;
        let position = world.translation.as_vec3();
        let direction = match (-world.matrix3.z_axis).try_normalize() {
            Some(direction) => direction.as_vec3().normalize(),
            None => return self.fail(at, "gives its light no direction"),
        };
        if light.range.is_some() {
            self.note(
                "KHR_lights_punctual range",
                format!("{place}.range"),
                "ignored; lights reach as far as physics says",
            );
        }
        let kind = match (&light.type_, &light.spot) {
            (Checked::Valid(Type::Point), _) => LightKind::Point {
                position,
                intensity: strength,
            },
            (Checked::Valid(Type::Directional), _) => LightKind::Directional {
                direction,
                irradiance: strength,
            },
            (Checked::Valid(Type::Spot), Some(spot)) => LightKind::Spot {
                position,
                direction,
                intensity: strength,
                inner: spot.inner_cone_angle,
                outer: spot.outer_cone_angle,
            },
            (Checked::Valid(Type::Spot), None) => return self.fail(place, "is a spot light without \"spot\""),
            (Checked::Invalid, _) => {
                return self.fail(format!("{place}.type"), "is not one of directional, point, spot");
            }
        };
        let name = light.name.as_deref().unwrap_or(node);
        self.reserve(name.len() as u64, at)?;
        self.scene.lights.push(Light {
            name: name.into(),
            kind,
        });
        Ok(())
    }
}

/// The rotation of a camera's node: its −Z and +Y axes without scale and shear; `None` when they vanish or coincide.
fn rotation_of(world: DAffine3) -> Option<DMat3> {
    let back = world.matrix3.z_axis.try_normalize()?;
    let right = world.matrix3.y_axis.cross(back).try_normalize()?;
    Some(DMat3::from_cols(right, back.cross(right), back))
}
