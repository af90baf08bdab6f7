//! The scenes on which the engine and Mitsuba 3 are compared.
//!
//! They are the engine's generated scenes, with flat shading and, where a material has no exact counterpart, another one: between them they hold every
//! material, light, camera, environment and medium that the exporter knows. Guarantees: a pure function; the exporter accepts every one (a test checks it).

use clerestory::Result;
use clerestory::scene::{
    Camera, Distribution, Environment, Geometry, Material, Microfacets, Projection, Scene, builtin, metals,
};
use glam::Vec3;

/// A scene to compare.
#[derive(Debug, Clone)]
pub struct ComparedScene {
    /// File name and key.
    pub name: &'static str,
    /// What it puts to the test.
    pub shows: &'static str,
    /// The scene; its first camera is used.
    pub scene: Scene,
}

/// All of them.
///
/// # Errors
/// Those of the generated scenes.
pub fn scenes() -> Result<Vec<ComparedScene>> {
    let mut all = Vec::new();
    let mut add = |name, shows, scene| all.push(ComparedScene { name, shows, scene });

    add("cornell-box", "Lambert, area light", flat("cornell-box")?);
    add(
        "cornell-point",
        "Lambert, point light",
        flat("cornell-box?source=point")?,
    );
    add(
        "cornell-mirror",
        "mirror sphere (white metal)",
        flat("cornell-box?sphere=mirror")?,
    );
    add(
        "cornell-glass",
        "clear glass sphere, caustic",
        flat("cornell-box?sphere=glass")?,
    );
    let mut frosted = flat("cornell-box?sphere=glass")?;
    repaint(&mut frosted, "glass", |m| m.roughness = 0.5);
    add("cornell-frosted", "rough glass sphere (alpha 0.25)", frosted);
    add("cornell-metals", "rough and smooth conductors", cornell_metals()?);
    let mut beckmann = flat("cornell-box?sphere=gold")?;
    repaint(&mut beckmann, "gold", |m| {
        m.roughness = 0.5;
        m.classic_microfacets = Some(Microfacets {
            distribution: Distribution::Beckmann,
            geometry: Geometry::Smith,
        });
    });
    add(
        "cornell-beckmann",
        "rough gold of Beckmann's distribution (slope 0.25) under Smith's term",
        beckmann,
    );

    let mut lens = flat("cornell-box")?;
    with_camera(&mut lens, |camera| {
        camera.lens_radius = 0.05;
        camera.focus_distance = 0.9;
    });
    add("cornell-lens", "thin lens", lens);
    let mut orthographic = flat("cornell-box")?;
    with_camera(&mut orthographic, |camera| {
        camera.projection = Projection::Orthographic { half_height: 0.25 };
    });
    add("cornell-orthographic", "orthographic camera", orthographic);

    let mut furnace = flat("furnace-box?rho=0.8,0.5,0.2")?;
    repaint(&mut furnace, "furnace", |m| m.double_sided = false);
    add("furnace-box", "everything emits and reflects", furnace);
    add(
        "furnace-glass",
        "rough glass (alpha 0.36) in a uniform environment",
        flat("white-furnace?transmission=1&thickness=1&roughness=0.6")?,
    );
    add(
        "furnace-metal",
        "rough white metal (alpha 0.36) in a uniform environment",
        flat("white-furnace?metallic=1&roughness=0.6")?,
    );

    let mut city = flat("box-city?n=49")?;
    city.environment = Some(Environment::uniform(Vec3::new(0.6, 0.8, 1.0)));
    add("box-city", "instances, uniform environment", city);
    add("box-city-sky", "environment map", flat("box-city?n=49")?);
    add(
        "sphere-flake",
        "directional light, uniform environment",
        flat("sphere-flake?depth=2&frequency=3&surface=diffuse")?,
    );
    add(
        "ring-rough",
        "rough gold, point light, caustic",
        flat("ring?smooth=no&metal=gold&roughness=0.4")?,
    );
    add(
        "ring-mirror",
        "smooth silver, point light",
        flat("ring?smooth=no&metal=silver")?,
    );

    let mut room = flat("box-room")?;
    repaint(&mut room, "mirror", |m| m.conductor = metals::by_name("silver"));
    add("box-room", "furnished room, silver mirror wall", room);
    add("passage", "indirect light only", flat("passage?width=0.4")?);

    add("fog-box", "thin fog in an invisible boundary", flat("fog-box?g=0.5")?);
    add(
        "fog-box-glass",
        "clear glass in chromatic fog",
        flat("fog-box?sphere=glass&sigma_s=1,2,3&phase=rayleigh")?,
    );
    add(
        "point-in-fog",
        "point light in endless fog",
        flat("point-in-fog?wall=white")?,
    );
    add(
        "medium-slab",
        "beam through an optically thick slab",
        flat("medium-slab?source=back&sigma_s=4&sigma_a=0.04&g=0.6&width=40")?,
    );
    add(
        "furnace-medium",
        "medium without absorption inside of glass",
        flat("furnace-medium?ior=1.3&shape=box")?,
    );
    add(
        "smoke",
        "grid of densities in an invisible boundary",
        flat("smoke?size=32")?,
    );
    add(
        "cloud",
        "dense grid, forward scattering, sun and sky",
        flat("cloud?size=32&albedo=0.98")?,
    );
    add("wax", "scattering inside of a rough solid", flat("wax?smooth=no")?);
    Ok(all)
}

/// A generated scene without interpolated normals.
fn flat(address: &str) -> Result<Scene> {
    let mut scene = builtin::generate(&format!("{}{address}", builtin::PREFIX))?;
    for mesh in &mut scene.meshes {
        mesh.normals.clear();
        mesh.tangents.clear();
    }
    Ok(scene)
}

/// A rough gold sphere, a smooth copper block and a rough aluminium block.
fn cornell_metals() -> Result<Scene> {
    let mut scene = flat("cornell-box?sphere=gold")?;
    for (mesh, metal, roughness) in [("short block", "copper", 0.0), ("tall block", "aluminium", 0.5)] {
        let material = scene.add_material(Material {
            conductor: metals::by_name(metal),
            roughness,
            ..Material::mirror(metal, Vec3::ONE)
        });
        for found in scene.meshes.iter_mut().filter(|m| m.name == mesh) {
            found.material = Some(material);
        }
    }
    Ok(scene)
}

fn repaint(scene: &mut Scene, material: &str, change: impl Fn(&mut Material)) {
    scene
        .materials
        .iter_mut()
        .filter(|m| m.name == material)
        .for_each(change);
}

fn with_camera(scene: &mut Scene, change: impl FnOnce(&mut Camera)) {
    if let Some(camera) = scene.cameras.first_mut() {
        change(camera);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mitsuba::export;

    #[test]
    fn every_scene_is_exported() -> Result<()> {
        let folder = tempfile::tempdir().map_err(|cause| clerestory::Error::io("temporary folder", cause))?;
        let all = scenes()?;
        for one in &all {
            let exported = export(&one.scene, "", [8, 8], &folder.path().join(one.name))?;
            assert!(exported.triangles > 0, "{}", one.name);
        }
        let mut names: Vec<_> = all.iter().map(|one| one.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
        Ok(())
    }

    #[test]
    fn replaced_materials_are_there() -> Result<()> {
        for (name, material) in [
            ("cornell-metals", "copper"),
            ("cornell-metals", "aluminium"),
            ("cornell-frosted", "glass"),
        ] {
            let all = scenes()?;
            let one = all
                .iter()
                .find(|one| one.name == name)
                .map(|one| &one.scene)
                .into_iter();
            let placed = one.flat_map(|scene| {
                scene
                    .meshes
                    .iter()
                    .filter_map(|mesh| scene.materials.get(mesh.material? as usize))
            });
            assert!(placed.into_iter().any(|m| m.name == material), "{name}");
        }
        Ok(())
    }
}
