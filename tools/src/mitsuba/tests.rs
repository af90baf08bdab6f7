use super::*;
use clerestory::scene::{
    AlphaMode, ConductorIor, Distribution, Geometry, Instance, Light, Material, Mesh, Microfacets,
};
use glam::Vec4;

fn quad(corners: [[f32; 3]; 4], material: u32) -> Mesh {
    Mesh {
        name: format!("quad of {material}"),
        positions: corners.map(Vec3::from).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A unit room with a lamp, a metal and a glass sheet's worth of faces.
fn room() -> Scene {
    let lamp = Material {
        emission: Vec3::splat(5.0),
        double_sided: false,
        ..Material::lambert("lamp", Vec3::ZERO)
    };
    let metal = Material {
        roughness: 0.3,
        conductor: Some(ConductorIor {
            eta: Vec3::new(0.2, 0.9, 1.1),
            k: Vec3::new(3.9, 2.4, 2.1),
        }),
        ..Material::default()
    };
    let meshes = vec![
        quad([[0., 0., 0.], [0., 0., 1.], [1., 0., 1.], [1., 0., 0.]], 0),
        quad(
            [[0.4, 0.99, 0.4], [0.6, 0.99, 0.4], [0.6, 0.99, 0.6], [0.4, 0.99, 0.6]],
            1,
        ),
        quad([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], 2),
    ];
    Scene {
        name: "room".into(),
        instances: (0..3)
            .map(|mesh| Instance {
                mesh,
                transform: DAffine3::IDENTITY,
                name: format!("node {mesh}"),
            })
            .collect(),
        meshes,
        materials: vec![Material::lambert("floor", Vec3::new(0.5, 0.25, 0.125)), lamp, metal],
        cameras: vec![Camera::look_at(
            "front",
            DVec3::new(0.5, 0.5, 3.0),
            DVec3::splat(0.5),
            DVec3::Y,
            0.5,
        )],
        ..Scene::default()
    }
}

fn export_text(scene: &Scene) -> Result<(String, Exported)> {
    let folder = tempfile::tempdir().map_err(|e| Error::io("temporary folder", e))?;
    let exported = export(scene, "", [64, 32], folder.path())?;
    let text = std::fs::read_to_string(&exported.scene).map_err(|e| Error::io(&exported.scene, e))?;
    assert!(exported.files.iter().all(|file| file.is_file()));
    Ok((text, exported))
}

fn reasons(scene: &Scene) -> String {
    let folder = std::env::temp_dir().join("clerestory-never-made");
    match export(scene, "", [8, 8], &folder) {
        Err(error @ Error::Unsupported { .. }) => {
            assert!(!folder.exists(), "a refused scene must leave no files");
            error.to_string()
        }
        other => format!("not refused: {other:?}"),
    }
}

#[test]
fn writes_the_plugins_of_each_material() -> Result<()> {
    let (text, exported) = export_text(&room())?;
    for part in [
        "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.5 0.25 0.125\"/></bsdf></bsdf>",
        "<emitter type=\"area\"><rgb name=\"radiance\" value=\"5 5 5\"/></emitter>",
        "<bsdf type=\"roughconductor\"><rgb name=\"eta\" value=\"0.2 0.9 1.1\"/><rgb name=\"k\" value=\"3.9 2.4 2.1\"/>",
        "<float name=\"alpha\" value=\"0.09",
        "<string name=\"fov_axis\" value=\"y\"/>",
        "<rfilter type=\"box\"/>",
        "<integer name=\"width\" value=\"64\"/>",
    ] {
        assert!(text.contains(part), "{part} is missing in\n{text}");
    }
    assert_eq!(
        (exported.triangles, exported.files.len(), exported.notes.len()),
        (6, 3, 1)
    );
    Ok(())
}

#[test]
fn camera_space_is_turned_about_the_vertical() {
    let camera = &room().cameras[0];
    let xml = camera_xml(camera, [64, 32], 4.0, "");
    let rows = "<matrix value=\"-1 0 0 0.5 0 1 0 0.5 0 0 -1 3 0 0 0 1\"/>";
    assert!(xml.contains(rows), "{xml}");
    let flat = Camera {
        projection: Projection::Orthographic { half_height: 2.0 },
        ..camera.clone()
    };
    assert!(
        camera_xml(&flat, [64, 32], 4.0, "").contains("<matrix value=\"-4 "),
        "half the width is 4"
    );
}

#[test]
fn mirrored_instances_keep_their_front() -> Result<()> {
    let mut scene = room();
    scene.instances[0].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let mesh =
        mesh::world_mesh(&scene, &scene.instances[0], false).map_err(|cause| Error::scene("test", "mesh", cause))?;
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).y > 0.0, "the floor must still face up");
    let ply = mesh::to_ply(&mesh);
    let header = b"end_header\n";
    let body = ply
        .windows(header.len())
        .position(|w| w == header)
        .map_or(0, |at| at + header.len());
    assert_eq!(ply.len() - body, 4 * 12 + 2 * 13);
    Ok(())
}

#[test]
fn refusals_name_the_material_and_the_reason() {
    type Edit = fn(&mut Material);
    let change = |edit: Edit| {
        let mut scene = room();
        edit(&mut scene.materials[0]);
        reasons(&scene)
    };
    let cases: [(Edit, &str); 9] = [
        (|m| m.specular = 1.0, "dielectric layer"),
        (|m| m.metallic = 0.5, "mixes"),
        (|m| m.metallic = 1.0, "Schlick"),
        (|m| m.transmission = 1.0, "thin wall"),
        (|m| m.emission = Vec3::ONE, "both sides"),
        (|m| m.phong = true, "Phong"),
        (|m| m.unlit = true, "unlit"),
        (|m| m.base_color = Vec4::splat(2.0), "[0, 1]"),
        (
            |m| {
                m.alpha_mode = AlphaMode::Blend;
                m.base_color.w = 0.5;
            },
            "holes",
        ),
    ];
    for (edit, reason) in cases {
        let message = change(edit);
        assert!(
            message.contains("\"floor\"") && message.contains(reason),
            "{reason}: {message}"
        );
    }
    let mut scene = room();
    scene.lights.push(Light {
        name: "stage".into(),
        kind: LightKind::Spot {
            position: Vec3::ONE,
            direction: -Vec3::Y,
            intensity: Vec3::ONE,
            inner: 0.1,
            outer: 0.2,
        },
    });
    scene.meshes[0].normals = vec![Vec3::X; 4];
    let message = reasons(&scene);
    assert!(
        message.contains("\"stage\"") && message.contains("shading normals"),
        "{message}"
    );
}

/// Of all pairs Mitsuba has GGX and Beckmann's distribution under Smith's term, without compensation on both sides.
#[test]
fn classical_microfacets_are_written_under_smiths_term_alone() -> Result<()> {
    for distribution in [Distribution::Ggx, Distribution::Beckmann, Distribution::CosineLobe] {
        for geometry in [Geometry::CookTorrance, Geometry::Simplified, Geometry::Smith] {
            let mut scene = room();
            scene.materials[2].name = "metal".into();
            scene.materials[2].classic_microfacets = Some(Microfacets { distribution, geometry });
            let cause = match (geometry, distribution) {
                (Geometry::Smith, Distribution::Ggx | Distribution::Beckmann) => {
                    let name = if distribution == Distribution::Ggx {
                        "ggx"
                    } else {
                        "beckmann"
                    };
                    let (text, exported) = export_text(&scene)?;
                    let written = format!("<string name=\"distribution\" value=\"{name}\"/>");
                    assert!(text.contains(&written) && exported.notes.is_empty(), "{text}");
                    continue;
                }
                (Geometry::Smith, Distribution::CosineLobe) => "cosine lobe",
                _ => "Smith",
            };
            let message = reasons(&scene);
            assert!(
                message.contains("\"metal\"") && message.contains("classical microfacets") && message.contains(cause),
                "{distribution:?} {geometry:?}: {message}"
            );
        }
    }
    Ok(())
}

#[test]
fn unknown_cameras_and_empty_sizes_are_errors() {
    let path = Path::new("never-made");
    assert!(matches!(
        export(&room(), "back", [8, 8], path),
        Err(Error::Setting { .. })
    ));
    assert!(matches!(export(&room(), "", [8, 0], path), Err(Error::Setting { .. })));
}

#[test]
fn environment_rows_become_nodes() -> Result<()> {
    let mut environment = Environment::uniform(Vec3::ONE);
    let uniform = environment_xml(&environment).map_err(|cause| Error::scene("test", "environment", cause))?;
    assert!(uniform.0.contains("constant") && uniform.1.is_none());
    (environment.width, environment.height) = (1, 2);
    environment.radiance = vec![Vec3::ZERO, Vec3::ONE];
    let (xml, map) = environment_xml(&environment).map_err(|cause| Error::scene("test", "environment", cause))?;
    assert!(xml.contains("envmap"));
    let values: Vec<f32> = map.iter().flat_map(|m| m.layers()[0].pixels()).map(|p| p[0]).collect();
    assert_eq!(values, [0.0, 0.0, 0.5, 1.0, 1.0]);
    Ok(())
}
