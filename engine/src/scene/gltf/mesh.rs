//! Mesh primitives: attributes, topologies, tangents ("glTF 2.0 Specification", §3.7.2; KHR_mesh_quantization).

use ::gltf::json;
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3, Vec4};

use super::Reader;
use crate::Result;
use crate::scene::{Material, Mesh, tangents};

impl Reader<'_> {
    /// The scene meshes of a glTF mesh's primitives, read at its first use.
    pub fn mesh(&mut self, i: usize, at: &str) -> Result<Vec<u32>> {
        if let Some(known) = self.meshes.get(&i) {
            return Ok(known.clone());
        }
        let source = self.get(&self.root.meshes, "mesh", i, at)?;
        let mut indices = Vec::new();
        for (k, primitive) in source.primitives.iter().enumerate() {
            let place = format!("meshes[{i}].primitives[{k}]");
            if let Some(mut mesh) = self.primitive(primitive, &place)? {
                if let Some(name) = source.name.as_ref().filter(|_| k > 0) {
                    self.reserve(name.len() as u64, &place)?;
                }
                mesh.name = match &source.name {
                    Some(name) if source.primitives.len() == 1 => name.clone(),
                    Some(name) => format!("{name} {k}"),
                    None => place,
                };
                indices.push(self.scene.add_mesh(mesh));
            }
        }
        self.meshes.insert(i, indices.clone());
        Ok(indices)
    }

    fn primitive(&mut self, primitive: &Primitive, at: &str) -> Result<Option<Mesh>> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(mode) => {
                self.note(format!("{mode:?} primitives"), at, "left out; they have no surface");
                return Ok(None);
            }
            Checked::Invalid => return self.fail(format!("{at}.mode"), "is not one of the primitive types"),
        };
        if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
            self.note("morph targets", format!("{at}.targets"), "the base shape is used");
        }
        if let Some(extensions) = &primitive.extensions {
            for name in extensions.others.keys() {
                // Without the extension such a primitive's data may be missing, which the checks below find.
                self.note(name, format!("{at}.extensions"), "ignored");
            }
        }
        let mut mesh = Mesh::default();
        let Some(position) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            self.note("primitive without POSITION", at, "left out");
            return Ok(None);
        };
        let place = format!("{at}.attributes.POSITION");
        let floats = self.floats(*position, &[3], &place)?;
        mesh.positions = floats.arrays().map(Vec3::from_array).collect();
        if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
            return self.fail(place, format!("element {i} is {}, not finite", mesh.positions[i]));
        }
        self.attributes(primitive, &mut mesh, at)?;
        let indices = match primitive.indices {
            None => (0..mesh.positions.len() as u32).collect(),
            Some(index) => {
                let place = format!("{at}.indices");
                let indices = self.indices(index, &place)?;
                if let Some(i) = indices.iter().position(|&v| v as usize >= mesh.positions.len()) {
                    let cause = format!(
                        "index {} at {i} is out of range; there are {} vertices",
                        indices[i],
                        mesh.positions.len()
                    );
                    return self.fail(place, cause);
                }
                indices
            }
        };
        mesh.triangles = match assemble(mode, &indices) {
            Some(triangles) => triangles,
            None => {
                let cause = format!("{} indices do not make whole triangles", indices.len());
                return self.fail(format!("{at}.indices"), cause);
            }
        };
        if let Some(material) = primitive.material {
            let place = format!("{at}.material");
            self.get(&self.root.materials, "material", material.value(), &place)?;
            mesh.material = Some(material.value() as u32);
            self.fit_to_material(&mut mesh, material.value(), at);
        }
        Ok(Some(mesh))
    }

    /// Reads everything but positions and indices.
    fn attributes(&mut self, primitive: &Primitive, mesh: &mut Mesh, at: &str) -> Result<()> {
        let n = mesh.positions.len();
        let mut file_tangents = Vec::new();
        for (semantic, &accessor) in &primitive.attributes {
            let Checked::Valid(semantic) = semantic else {
                self.note("attribute with a name that glTF does not define", at, "ignored");
                continue;
            };
            let place = format!("{at}.attributes.{}", semantic.to_string());
            let widths: &[usize] = match semantic {
                Semantic::Normals => &[3],
                Semantic::Tangents => &[4],
                Semantic::TexCoords(0 | 1) => &[2],
                Semantic::Colors(0) => &[3, 4],
                Semantic::Positions | Semantic::Extras(_) => continue,
                Semantic::Joints(_) | Semantic::Weights(_) => {
                    self.note("skinning", place, "the mesh is used as it is stored");
                    continue;
                }
                Semantic::TexCoords(_) | Semantic::Colors(_) => {
                    self.note(semantic.to_string(), place, "ignored");
                    continue;
                }
            };
            let floats = self.floats(accessor, widths, &place)?;
            let count = floats.values.len() / floats.width;
            if count != n {
                return self.fail(place, format!("has {count} elements for {n} positions"));
            }
            let mut replaced = 0;
            match semantic {
                Semantic::Normals => {
                    mesh.normals = floats.arrays().map(Vec3::from_array).collect();
                    replaced = repair_normals(&mut mesh.normals);
                }
                Semantic::Tangents => file_tangents = floats.arrays().map(Vec4::from_array).collect(),
                Semantic::TexCoords(set) => {
                    let mut uv: Vec<Vec2> = floats.arrays().map(Vec2::from_array).collect();
                    for value in uv.iter_mut().filter(|v| !v.is_finite()) {
                        *value = Vec2::ZERO;
                        replaced += 1;
                    }
                    *(if *set == 0 { &mut mesh.uv0 } else { &mut mesh.uv1 }) = uv;
                }
                _ => {
                    mesh.colors = if floats.width == 3 {
                        floats.arrays::<3>().map(|c| Vec3::from_array(c).extend(1.0)).collect()
                    } else {
                        floats.arrays().map(Vec4::from_array).collect()
                    };
                    for value in mesh
                        .colors
                        .iter_mut()
                        .filter(|c| !c.is_finite() || c.min_element() < 0.0)
                    {
                        *value = Vec4::ONE;
                        replaced += 1;
                    }
                }
            }
            if replaced > 0 {
                self.note(
                    "unusable vertex attribute values",
                    place,
                    format!("{replaced} replaced"),
                );
            }
        }
        // §3.7.2.1: without normals, tangents in the file are to be ignored.
        if !mesh.normals.is_empty() {
            let pairs = file_tangents.iter().zip(&mesh.normals);
            mesh.tangents = pairs.map(|(t, n)| tangents::sound_tangent(*t, *n)).collect();
        }
        Ok(())
    }

    /// Makes tangents for a normal map, drops those that nothing uses, and reports missing texture coordinates.
    fn fit_to_material(&mut self, mesh: &mut Mesh, index: usize, at: &str) {
        let material: &Material = &self.scene.materials[index];
        let missing: Vec<u32> = (0..2)
            .filter(|&set| {
                let uv = if set == 0 { &mesh.uv0 } else { &mesh.uv1 };
                uv.is_empty() && material.textures().any(|(_, texture)| texture.uv_set == set)
            })
            .collect();
        match material.normal_texture {
            None => mesh.tangents.clear(),
            Some(texture) => {
                if mesh.tangents.is_empty() && !tangents::generate_from(mesh, texture.uv_set) {
                    self.note(
                        "normal map without tangents",
                        at,
                        "the surface is taken as smooth there",
                    );
                }
            }
        }
        for set in missing {
            self.note(format!("missing TEXCOORD_{set}"), at, "its textures are read at (0, 0)");
        }
    }
}

/// Makes normals unit; those that cannot be take +Y. Returns how many.
fn repair_normals(normals: &mut [Vec3]) -> usize {
    let mut replaced = 0;
    for normal in normals {
        let unit = if normal.is_finite() {
            normal.try_normalize()
        } else {
            None
        };
        *normal = unit.unwrap_or_else(|| {
            replaced += 1;
            Vec3::Y
        });
    }
    replaced
}

/// Triangles of a topology (§3.7.2.1, figure on primitive types); `None` when indices are left over.
fn assemble(mode: json::mesh::Mode, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    let n = indices.len();
    match mode {
        Mode::Triangles => {
            let (triangles, []) = indices.as_chunks::<3>() else {
                return None;
            };
            Some(triangles.to_vec())
        }
        _ if n < 3 => None,
        Mode::TriangleStrip => Some(
            (0..n - 2)
                .map(|i| [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]])
                // Strips are stitched by repeated indices, which are not a surface.
                .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
                .collect(),
        ),
        _ => Some((1..n - 1).map(|i| [indices[i], indices[i + 1], indices[0]]).collect()),
    }
}
