//! Scenes from files through the one entrance: sidecars, bare meshes, environment maps, and refusals with their place.

use std::path::Path;

use clerestory::Error;
use clerestory::scene::{self, EnvironmentUse, Material, MediaUse, Phase, PhaseUse, Projection, Scene, SceneProfile};
use clerestory::transport::phong::phong_exponent;
use glam::{DVec3, Vec3};

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl ring\nf 1 2 3\n";
const MTL: &str = "newmtl ring\nKd 0.5 0.5 0.5\n";

/// A folder with an OBJ model `m.obj` and a sidecar beside it.
fn folder(sidecar: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    std::fs::write(folder.path().join("m.obj"), OBJ).expect("file");
    std::fs::write(folder.path().join("m.mtl"), MTL).expect("file");
    std::fs::write(folder.path().join("m.scene.toml"), sidecar).expect("file");
    folder
}

fn load(folder: &Path, name: &str) -> Result<Scene, Error> {
    scene::load(&folder.join(name).display().to_string())
}

fn refusal(sidecar: &str) -> String {
    load(folder(sidecar).path(), "m.obj")
        .expect_err("must be refused")
        .to_string()
}

#[test]
fn a_bare_mesh_is_framed_and_lit() {
    let folder = folder("");
    let scene = load(folder.path(), "m.obj").expect("scene");
    assert_eq!((scene.name.as_str(), scene.cameras[0].name.as_str()), ("m", "main"));
    assert_eq!(SceneProfile::of(&scene).environment, EnvironmentUse::Constant);
    let features: Vec<&str> = scene.notes.iter().map(|n| n.feature.as_str()).collect();
    assert_eq!(features, ["no camera in the file", "no light in the file"]);
    // Every vertex is inside the square picture.
    let view = scene.cameras[0].transform.inverse();
    let Projection::Perspective { fov_y } = scene.cameras[0].projection else {
        panic!("perspective");
    };
    let half = (f64::from(fov_y) / 2.0).tan();
    for p in &scene.meshes[0].positions {
        let q = view.transform_point3(p.as_dvec3());
        assert!(q.z < 0.0 && q.x.abs() < -q.z * half && q.y.abs() < -q.z * half);
    }
}

#[test]
fn geometry_that_no_camera_can_frame_is_named_not_the_camera() {
    let of = |sidecar: &str, far: &str| {
        let folder = folder(sidecar);
        let obj = OBJ.replace("v 1 0 0", &format!("v {far} 0 0"));
        std::fs::write(folder.path().join("m.obj"), obj).expect("file");
        load(folder.path(), "m.obj")
    };
    let message = of("", "3e38").expect_err("too far").to_string();
    assert!(
        message.contains("geometry") && message.contains("no camera can frame"),
        "{message}"
    );
    assert!(!message.contains("cameras[0]"), "{message}");
    // What is as far as can be framed, or is seen by a camera of the user's own, is none of it.
    of("", "1e30").expect("a camera far away");
    of(
        "[[cameras]]\nname = \"near\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\n",
        "3e38",
    )
    .expect("a camera near the origin");
}

#[test]
fn a_sidecar_adds_what_the_model_cannot_say() {
    let folder = folder(
        "exposure = 1.5\ntechnique = \"path\"\naspect = 2.0\n[environment]\ncolor = [1.0, 2.0, 3.0]\nstrength = 2.0\nrotation = 90.0\n\
         [metals]\nring = \"gold\"\n[[cameras]]\nname = \"main\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfov = 60.0\n\
         aperture = 0.25\n[medium]\nsigma_a = [0.1, 0.1, 0.1]\nsigma_s = [1.0, 1.0, 1.0]\ng = 0.5\n",
    );
    let scene = load(folder.path(), "m.obj").expect("scene");
    assert_eq!(scene.defaults.exposure, 1.5);
    assert_eq!(
        (scene.defaults.technique.as_deref(), scene.defaults.aspect),
        (Some("path"), Some(2.0))
    );
    let environment = scene.environment.as_ref().expect("environment");
    assert_eq!(
        (environment.radiance[0], environment.strength),
        (Vec3::new(1.0, 2.0, 3.0), 2.0)
    );
    assert!((environment.rotation * Vec3::Z).distance(Vec3::X) < 1e-6);
    assert!(scene.materials[0].conductor == scene::metals::by_name("gold") && scene.materials[0].metallic == 1.0);
    let camera = &scene.cameras[0];
    assert_eq!((camera.lens_radius, camera.focus_distance), (0.25, 5.0));
    assert_eq!(camera.transform.translation, DVec3::new(0.0, 0.0, 5.0));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let medium = &scene.media[0];
    assert_eq!((scene.media.len(), scene.surrounding), (1, Some(0)));
    assert_eq!(
        (medium.sigma_a, medium.sigma_s, medium.phase),
        (Vec3::splat(0.1), Vec3::ONE, Phase::HenyeyGreenstein { g: 0.5 })
    );
    assert!(SceneProfile::of(&scene).has_lens);
}

#[test]
fn the_sidecar_of_the_reference_is_understood() {
    let reference = include_str!("../../docs/reference.md");
    let block = reference
        .split("```toml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next());
    let folder = folder(block.expect("a TOML block"));
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("file");
    let more = ["bowl", "vase", "cup", "coin", "pan", "floor", "bounds"];
    let faces = more.map(|name| format!("usemtl {name}\nf 1 3 2\n")).concat();
    let materials = more.map(|name| format!("newmtl {name}\nKd 0.5 0.5 0.5\n")).concat();
    write("m.obj", &format!("{OBJ}{faces}"));
    write("m.mtl", &format!("{MTL}{materials}"));
    write("coin.csv", "380 1.2 3.0\n780 0.9 4.0\n");
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 4, 2, |_, _| (1.0, 1.0, 1.0)).expect("EXR");
    let scene = load(folder.path(), "m.obj").expect("scene");
    assert!(scene.materials[0].conductor.is_some() && scene.materials[1].conductor.is_some());
    assert!(scene.materials[2..5].iter().all(|metal| metal.conductor.is_some()));
    assert_eq!(scene.materials[2].fresnel, scene::FresnelForm::Compensated);
    assert!(scene.materials[5].classic_microfacets.is_some() && scene.materials[2].classic_microfacets.is_none());
    assert!(scene.materials[6].phong && scene.materials[6].metallic == 0.4);
    assert_eq!((scene.defaults.exposure, scene.cameras[0].lens_radius), (0.5, 0.01));
    assert_eq!(scene.defaults.aspect, Some(1.5));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let media = SceneProfile::of(&scene).media;
    assert!(media.surrounding && media.boundaries && media.heterogeneous && media.count == 2);
    assert!(scene.materials[7].interior == Some(1) && scene.media[1].density.is_some());
}

#[test]
fn metals_are_named_measured_or_coloured_and_name_their_form() {
    use clerestory::scene::{Distribution, FresnelForm, Geometry, Microfacets};
    let load_metal = |text: &str| {
        let folder = folder(&format!("[metals]\nring = {text}\n"));
        std::fs::write(folder.path().join("n k.csv"), "380, 0.5, 2.0\n780, 0.5, 2.0\n").expect("file");
        load(folder.path(), "m.obj").expect(text)
    };
    let gold = scene::metals::by_name("gold");
    for form in FresnelForm::ALL {
        let scene = load_metal(&format!("{{ metal = \"gold\", fresnel = \"{form}\" }}"));
        let ring = &scene.materials[0];
        assert_eq!((ring.conductor, ring.fresnel, ring.metallic), (gold, form, 1.0));
        let profile = SceneProfile::of(&scene);
        assert!(profile.has_conductor && profile.has_other_conductor == (form != FresnelForm::Exact));
    }
    assert_eq!(load_metal("\"gold\"").materials[0].fresnel, FresnelForm::Exact);
    let spectrum = load_metal("{ spectrum = \"n k.csv\" }").materials[0]
        .conductor
        .expect("conductor");
    assert!((spectrum.eta - 0.5).abs().max_element() < 1e-6 && (spectrum.k - 2.0).abs().max_element() < 1e-6);
    let colors =
        load_metal("{ reflectance = [0.9, 0.5, 0.04], edge_tint = [1.0, 0.5, 0.0], fresnel = \"simplified\" }");
    let colors = colors.materials[0].conductor.expect("conductor");
    assert!(
        (colors.eta.x - 0.1 / 1.9).abs() < 1e-6 && colors.eta.z > 1.49 && colors.k.z < 1e-3,
        "{colors:?}"
    );
    for (text, words) in [
        ("{ metal = \"mithril\" }", "gold"),
        ("{ metal = \"gold\", fresnel = \"quick\" }", "f82-tint"),
        ("{ metal = \"gold\", eta = [1, 1, 1] }", "needs one of"),
        ("{ eta = [1, 1, 1] }", "needs one of"),
        ("{ fresnel = \"rescaled\" }", "needs one of"),
        ("{ eta = [0, 1, 1], k = [1, 1, 1] }", "eta from a millionth"),
        ("{ eta = [1, 1, 1], k = [1e10, 1, 1] }", "k from 0 to a million"),
        ("{ eta = [1, 1, 1], k = [1, 1, -0.1] }", "k from 0 to a million"),
        ("{ eta = [1, 1, 1], k = [1, nan, 1] }", "k from 0 to a million"),
        ("{ spectrum = \"nowhere.csv\" }", "metals.ring.spectrum"),
        ("{ spectrum = \"m.obj\" }", "line 1"),
    ] {
        let message = refusal(&format!("[metals]\nring = {text}\n"));
        assert!(message.contains(words), "{text}: {message}");
    }
    let beckmann = load_metal("{ metal = \"gold\", distribution = \"beckmann\" }");
    let microfacets = beckmann.materials[0].classic_microfacets.expect("microfacets");
    assert_eq!(
        (microfacets.distribution, microfacets.geometry),
        (Distribution::Beckmann, Geometry::CookTorrance)
    );
    assert!(SceneProfile::of(&beckmann).has_classic_microfacets);
    for (word, geometry) in [("simplified", Geometry::Simplified), ("smith", Geometry::Smith)] {
        let metal = load_metal(&format!("{{ metal = \"gold\", geometry = \"{word}\" }}"));
        let distribution = Distribution::Ggx;
        let expected = Microfacets { distribution, geometry };
        assert_eq!(metal.materials[0].classic_microfacets, Some(expected));
    }
    // Materials that cannot have them are named by the sidecar's key.
    for name in ["worn metal", "glass"] {
        let metal = format!("{name:?} = {{ metal = \"gold\", distribution = \"beckmann\" }}");
        let folder = folder(&format!("file = \"builtin:materials\"\n[metals]\n{metal}\n"));
        let message = load(folder.path(), "m.scene.toml").expect_err(name).to_string();
        assert!(
            message.contains(&format!("metals.{name}")) && message.contains("microfacets"),
            "{message}"
        );
    }
    let mut partial = beckmann;
    partial.materials[0].metallic = 0.5;
    let message = partial.check().expect_err("half a metal").to_string();
    assert!(message.contains("microfacets"), "{message}");
    // A form needs an index.
    let mut scene = load_metal("\"gold\"");
    scene.materials[0].conductor = None;
    scene.materials[0].fresnel = FresnelForm::Compensated;
    let message = scene.check().expect_err("no conductor").to_string();
    assert!(message.contains("compensated needs a conductor"), "{message}");
}

/// A metal by its reflectance at normal incidence and its edge tint: the index that a scene holds gives both colours back, in every form of the factor.
#[test]
fn two_colours_of_a_metal_are_kept_or_refused() {
    use clerestory::scene::FresnelForm;
    use clerestory::scene::metals::artistic::{artistic_index, artistic_parameters};
    let load_metal = |text: &str| {
        let folder = folder(&format!("[metals]\nring = {text}\n"));
        load(folder.path(), "m.obj").expect(text)
    };
    let (reflectance, edge_tint) = (Vec3::new(0.9, 0.5, 0.04), Vec3::new(1.0, 0.5, 0.0));
    let colors = "reflectance = [0.9, 0.5, 0.04], edge_tint = [1.0, 0.5, 0.0]";
    let named = FresnelForm::ALL.map(|form| (form, format!(", fresnel = \"{form}\"")));
    for (form, fresnel) in named.into_iter().chain([(FresnelForm::Exact, String::new())]) {
        let scene = load_metal(&format!("{{ {colors}{fresnel} }}"));
        let ring = &scene.materials[0];
        assert_eq!((ring.fresnel, ring.metallic), (form, 1.0));
        assert!(scene.notes.iter().all(|note| !note.feature.contains("reflectance")));
        let ior = ring.conductor.expect("conductor");
        let [eta, k] = artistic_index(reflectance.as_dvec3(), edge_tint.as_dvec3()).map(|part| part.as_vec3());
        assert_eq!((ior.eta, ior.k), (eta, k), "{form}");
        let kept = artistic_parameters(ior.eta.as_dvec3(), ior.k.as_dvec3());
        for (kept, given) in kept.into_iter().zip([reflectance, edge_tint]) {
            assert!(
                (kept - given.as_dvec3()).abs().max_element() < 1e-6,
                "{form}: {kept} {given}"
            );
        }
    }
    // Whole numbers are numbers, and the ends are in range; what no index reflects is cut off with a note.
    let scene = load_metal("{ reflectance = [1, 0, 1], edge_tint = [0, 1, 1] }");
    scene.check().expect("sound");
    let note = scene
        .notes
        .iter()
        .find(|note| note.feature == "reflectance above 0.9999");
    assert_eq!(note.expect("note").at, "metals.ring");
    for (text, words) in [
        (
            "{ reflectance = [1, 1, 2], edge_tint = [0, 0, 0] }",
            "\"metals.ring.reflectance\": 2 in blue",
        ),
        (
            "{ reflectance = [-0.1, 1, 1], edge_tint = [0, 0, 0] }",
            "\"metals.ring.reflectance\": -0.1 in red",
        ),
        (
            "{ reflectance = [1, nan, 1], edge_tint = [0, 0, 0] }",
            "\"metals.ring.reflectance\": NaN in green",
        ),
        (
            "{ reflectance = [1, -inf, 1], edge_tint = [0, 0, 0] }",
            "\"metals.ring.reflectance\": -inf in green",
        ),
        (
            "{ reflectance = [1, 1, 1], edge_tint = [0, 1.5, 0] }",
            "\"metals.ring.edge_tint\": 1.5 in green",
        ),
        (
            "{ reflectance = [1, 1, 1], edge_tint = [nan, 0, 0] }",
            "\"metals.ring.edge_tint\": NaN in red",
        ),
        (
            "{ reflectance = [1, 1, 1], edge_tint = [0, 0, inf] }",
            "\"metals.ring.edge_tint\": inf in blue",
        ),
        (
            "{ reflectance = [1, 1, 1], edge_tint = [0, 0, 1e39] }",
            "\"metals.ring.edge_tint\": inf in blue",
        ),
        ("{ reflectance = [1, 1, 1] }", "needs one of"),
        ("{ edge_tint = [1, 1, 1] }", "needs one of"),
        (
            "{ reflectance = [1, 1, 1], edge_tint = [0, 0, 0], metal = \"gold\" }",
            "needs one of",
        ),
        ("{ reflectance = [1, 1, 1], k = [1, 1, 1] }", "needs one of"),
        // What is no table of the known keys has the line and what was expected.
        (
            "{ reflectance = [1, 1], edge_tint = [0, 0, 0] }",
            "reflectance and edge_tint",
        ),
        (
            "{ reflectance = 1, edge_tint = [0, 0, 0] }",
            "reflectance and edge_tint",
        ),
        (
            "{ reflectance = [1, 1, \"1\"], edge_tint = [0, 0, 0] }",
            "reflectance and edge_tint",
        ),
        (
            "{ reflectance = [1, 1, 1], edge_color = [0, 0, 0] }",
            "reflectance and edge_tint",
        ),
    ] {
        let message = refusal(&format!("[metals]\nring = {text}\n"));
        assert!(message.contains(words), "{text}: {message}");
    }
}

#[test]
fn modified_phong_surfaces_are_loaded_and_checked() {
    let folder = folder("[phong]\nring = { exponent = 20, share = 0.25 }\n");
    let scene = load(folder.path(), "m.obj").expect("scene");
    let ring = &scene.materials[0];
    let built = Material::phong("ring", Vec3::splat(0.5), 0.25, 20.0);
    assert!(ring.phong && ring.specular == 0.0);
    assert_eq!((ring.metallic, ring.roughness), (built.metallic, built.roughness));
    let exponent = phong_exponent(f64::from(ring.roughness).powi(2));
    assert!((exponent - 20.0).abs() < 1e-4, "{exponent}");
    let profile = SceneProfile::of(&scene);
    assert!(profile.has_phong && profile.has_metal && !profile.has_rough_dielectric_spec);
    // All of it is the lobe where nothing else is said.
    let whole = load(self::folder("[phong]\nring = { exponent = 0.0 }\n").path(), "m.obj").expect("scene");
    assert_eq!((whole.materials[0].metallic, whole.materials[0].roughness), (1.0, 1.0));
    for (text, words) in [
        ("[phong]\nring = { exponent = -1.0 }\n", "phong.ring"),
        ("[phong]\nring = { exponent = nan }\n", "0 to 100000"),
        ("[phong]\nring = { exponent = 5.0, share = 1.5 }\n", "share from 0 to 1"),
        ("[phong]\nring = 5.0\n", "line 2"),
        ("[phong]\nwing = { exponent = 5.0 }\n", "ring"),
        (
            "[metals]\nring = \"gold\"\n[phong]\nring = { exponent = 5.0 }\n",
            "conductor",
        ),
    ] {
        let message = refusal(text);
        assert!(message.contains(words), "{text}: {message}");
    }
    type Change = fn(&mut Material);
    let changes: [(Change, &str); 2] = [
        (|m| m.transmission = 0.5, "transmission"),
        (|m| m.specular = 0.5, "specular"),
    ];
    for (change, field) in changes {
        let mut scene = scene.clone();
        change(&mut scene.materials[0]);
        let message = scene.check().expect_err(field).to_string();
        assert!(message.contains(field) && message.contains("Phong"), "{message}");
    }
}

#[test]
fn several_media_find_their_places() {
    let folder = folder(
        "[[medium]]\nsigma_a = 0.5\nphase = \"rayleigh\"\n\
         [[medium]]\nname = \"smoke\"\nmaterial = \"ring\"\nboundary = true\nsigma_t = [4, 8, 16.0]\nalbedo = 0.75\n\
         emission = [0.0, 0.0, 2.0]\nphase = \"schlick\"\nk = -0.5\n",
    );
    let scene = load(folder.path(), "m.obj").expect("scene");
    assert_eq!((scene.surrounding, scene.materials[0].interior), (Some(0), Some(1)));
    assert!(scene.materials[0].boundary);
    let names: Vec<&str> = scene.media.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["surrounding", "smoke"]);
    let [air, smoke] = &scene.media[..] else {
        panic!("two media")
    };
    assert_eq!(
        (air.sigma_a, air.sigma_s, air.phase),
        (Vec3::splat(0.5), Vec3::ZERO, Phase::Rayleigh)
    );
    assert_eq!(smoke.sigma_s, Vec3::new(3.0, 6.0, 12.0));
    assert_eq!(smoke.sigma_a, Vec3::new(1.0, 2.0, 4.0));
    assert_eq!((smoke.emission.z, smoke.phase), (2.0, Phase::Schlick { k: -0.5 }));
    let profile = SceneProfile::of(&scene);
    let expected = MediaUse {
        count: 2,
        homogeneous: true,
        heterogeneous: false,
        absorbs: true,
        scatters: true,
        emits: true,
        emits_endlessly: false,
        chromatic: true,
        // What does not scatter has no use for its phase function.
        phases: PhaseUse {
            schlick: true,
            ..PhaseUse::default()
        },
        surrounding: true,
        boundaries: true,
        in_solids: false,
    };
    assert_eq!(profile.media, expected);
    assert!(profile.media.any() && !MediaUse::default().any());
    assert!(
        profile.to_string().contains("media         2, homogeneous"),
        "{profile}"
    );
}

#[test]
fn densities_are_generated_or_read_and_placed() {
    let with = |density: &str| folder(&format!("[[medium]]\nsigma_a = 1.0\ndensity = {{ {density} }}\n"));
    let grid = |folder: &tempfile::TempDir| {
        let mut scene = load(folder.path(), "m.obj").expect("scene");
        assert!(SceneProfile::of(&scene).media.heterogeneous);
        scene.media.remove(0).density.expect("grid")
    };
    let made = grid(&with(
        "generate = \"gradient\", size = [4, 2, 1], factor = 8, low = [0, 0, 0], high = [2, 2, 2]",
    ));
    assert_eq!((made.size, &made.values[..4]), ([4, 2, 1], &[1.0, 3.0, 5.0, 7.0][..]));
    assert_eq!(made.density(DVec3::new(1.0, 1.0, 1.0)), 4.0);
    // A quarter turn about +Y takes +X to −Z.
    let turned = grid(&with(
        "generate = \"gradient\", size = 4, scale = 2, rotate = [0, 90, 0], translate = [0, 0, 10]",
    ));
    assert!((turned.density(DVec3::new(1.0, 1.0, 9.0)) - 0.5).abs() < 1e-12);
    assert!((turned.density(DVec3::new(1.0, 1.0, 8.1)) - 0.875).abs() < 1e-7);

    let file = with("file = \"d.vol\"");
    let (low, high) = (DVec3::ZERO, DVec3::new(4.0, 1.0, 1.0));
    std::fs::write(
        file.path().join("d.vol"),
        scene::medium::vol::to_bytes(&made, &[1.0], low, high),
    )
    .expect("file");
    let read = grid(&file);
    assert_eq!(
        (&read.values, read.density(DVec3::new(2.0, 0.5, 0.5))),
        (&made.values, 4.0)
    );

    let raw = with("file = \"d.raw\", size = [2, 1, 1], type = \"uint8\", offset = 1");
    std::fs::write(raw.path().join("d.raw"), [9, 0, 255]).expect("file");
    assert_eq!(grid(&raw).values, [0.0, 1.0]);
    std::fs::write(raw.path().join("d.raw"), [9, 0]).expect("file");
    let error = load(raw.path(), "m.obj").expect_err("short").to_string();
    assert!(
        error.contains("d.raw") && error.contains("3 bytes are wanted"),
        "{error}"
    );
    for (density, expected) in [
        ("file = \"a.vol\", generate = \"smoke\"", "either file or generate"),
        ("file = \"none.vol\"", "none.vol"),
        ("file = \"a.nvdb\"", "mitsuba2-vdb-converter"),
        ("file = \"a.raw\"", "needs size"),
        ("file = \"a.raw\", size = 2, type = \"int8\"", "known: uint8"),
        (
            "file = \"a.raw\", size = 2, endian = \"middle\"",
            "neither little nor big",
        ),
        ("file = \"a.vol\", size = 2", "says itself"),
        ("generate = \"fog\"", "known: constant, gradient"),
        ("generate = \"ball\", size = 513", "between 1 and 512"),
        ("generate = \"ball\", size = [1, 2]", "a number or three"),
        ("generate = \"ball\", factor = -1", "factor"),
        ("generate = \"ball\", low = [0, 0, 0]", "both low and high"),
        ("generate = \"ball\", low = [0, 0, 0], high = [1, 0, 1]", "below high"),
        ("generate = \"ball\", scale = 0", "must not be 0"),
        ("generate = \"ball\", colour = 0", "line 3"),
    ] {
        let error = load(with(density).path(), "m.obj").expect_err(density).to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}

#[test]
fn a_sidecar_can_be_the_scene() {
    let folder = folder("");
    std::fs::write(folder.path().join("dusk.toml"), "file = \"m.obj\"\nexposure = -1.0\n").expect("file");
    let scene = load(folder.path(), "dusk.toml").expect("scene");
    assert_eq!((scene.name.as_str(), scene.defaults.exposure), ("dusk", -1.0));
    let with = |text: &str| {
        std::fs::write(folder.path().join("other.toml"), text).expect("file");
        load(folder.path(), "other.toml")
    };
    let ring = with("file = \"builtin:ring?metal=gold\"\nexposure = 1.0\n").expect("generated scene");
    assert_eq!(
        (ring.name.as_str(), ring.defaults.exposure, ring.lights.len()),
        ("other", 1.0, 1)
    );
    for (text, word) in [
        ("exposure = 1.0\n", "file = "),
        ("file = \"none.glb\"\n", "key \"file\""),
        ("file = \"dusk.toml\"\n", "another sidecar"),
        ("file = \"builtin:nowhere\"\n", "nowhere"),
        ("file = \"m\"\n", "ending"),
    ] {
        let error = with(text).expect_err("must be refused").to_string();
        assert!(error.contains(word), "{word}: {error}");
    }
}

#[test]
fn sidecar_faults_have_their_line_or_key() {
    for (sidecar, expected) in [
        ("exposure = 1.0\nlens = 3\n", "line 2"),
        ("[environment]\ncolour = [1.0, 1.0, 1.0]\n", "line 2"),
        ("[metals]\nring = \"mithril\"\n", "gold, silver, copper, aluminium"),
        ("[metals]\nbell = \"gold\"\n", "no material has that name"),
        (
            "[metals]\nring = { eta = [0.0, 1.0, 1.0], k = [1.0, 1.0, 1.0] }\n",
            "metals.ring",
        ),
        ("[[cameras]]\nname = \"new\"\n", "cameras.new"),
        (
            "[[cameras]]\nname = \"a\"\neye = [0.0, 1.0, 0.0]\ntarget = [0.0, 1.0, 0.0]\n",
            "cameras.a",
        ),
        (
            "[[cameras]]\nname = \"a\"\neye = [0.0, 1.0, 0.0]\ntarget = [0.0, 0.0, 0.0]\n",
            "up points along the view",
        ),
        ("[environment]\nstrength = 1.0\n", "either file or color"),
        ("[environment]\nfile = \"none.exr\"\n", "none.exr"),
        ("[environment]\nfile = \"m.obj\"\n", "environment.file"),
        ("exposure = \"bright\"\n", "expected a number"),
        ("[environment]\ncolor = [nan, 0.0, 0.0]\n", "environment.color"),
        (
            "[medium]\nsigma_a = [0.0, 0.0, 0.0]\nsigma_s = [0.0, 0.0, 0.0]\ng = 1.0\n",
            "medium.g",
        ),
        (
            "[medium]\nmaterial = \"fog\"\nsigma_a = [0.0, 0.0, 0.0]\nsigma_s = [0.0, 0.0, 0.0]\n",
            "medium.material",
        ),
        ("[medium]\nsigma_a = [0.0, 0.0]\nsigma_s = [0.0, 0.0, 0.0]\n", "line 2"),
        (
            "[medium]\nsigma_a = [-1.0, 0.0, 0.0]\nsigma_s = [0.0, 0.0, 0.0]\n",
            "at least 0",
        ),
        ("[[medium]]\nsigma_a = 1.0\n[[medium]]\nsigma_a = 1.0\n", "medium[1]"),
        ("[medium]\nsigma_a = 1.0\nphase = \"mie\"\n", "known: isotropic, hg"),
        ("[medium]\nsigma_a = 1.0\nphase = \"rayleigh\"\ng = 0.1\n", "medium.g"),
        ("[medium]\nsigma_a = 1.0\nphase = \"hg\"\nk = 0.1\n", "medium.k"),
        ("[medium]\nsigma_t = 1.0\n", "sigma_t with albedo"),
        ("[medium]\nsigma_t = 1.0\nalbedo = 1.5\n", "medium.albedo"),
        ("[medium]\nsigma_t = 1.0\nalbedo = 0.5\nsigma_a = 1.0\n", "mixture"),
        ("[medium]\nboundary = true\n", "medium.boundary"),
        (
            "[[medium]]\nname = \"a\"\nmaterial = \"ring\"\nsigma_a = 1.0\n",
            "no light reaches",
        ),
        ("[[medium]]\nsigma_a = \"thick\"\n", "a number or three"),
        ("[[medium]]\n[[medium]]\nsigma_b = 1.0\n", "line 3"),
        (
            "[[medium]]\nmaterial = \"ring\"\nboundary = true\n[[medium]]\nmaterial = \"ring\"\n",
            "another medium",
        ),
        ("exposure = nan\n", "exposure"),
        ("aspect = 0.0\n", "aspect"),
        (
            "[[cameras]]\nname = \"main\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfov = 180.0\n",
            "cameras.main.fov",
        ),
        (
            "[[cameras]]\nname = \"main\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\naperture = -1.0\n",
            "aperture",
        ),
        (
            "[[cameras]]\nname = \"main\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfocus = 0.0\n",
            "focus",
        ),
        ("exposure = \n", "line 1"),
    ] {
        let error = refusal(sidecar);
        assert!(error.contains(expected), "{expected}: {error}");
    }
}

#[test]
fn cut_and_changed_sidecars_are_read_or_refused() {
    let text = "exposure = 1.5\n[environment]\ncolor = [1.0, 2.0, 3.0]\n[metals]\nring = { eta = [1.0, 1.0, 1.0], k = [2.0, 2.0, 2.0] }\n\
                [[cameras]]\nname = \"main\"\neye = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\n[medium]\nsigma_a = [0.1, 0.1, 0.1]\n\
                sigma_s = [1.0, 1.0, 1.0]\n";
    let folder = folder(text);
    let read = |bytes: &[u8]| {
        std::fs::write(folder.path().join("m.scene.toml"), bytes).expect("file");
        load(folder.path(), "m.obj").is_ok()
    };
    assert!(read(text.as_bytes()));
    for place in 0..text.len() {
        let _ = read(&text.as_bytes()[..place]);
        for byte in [b'9', b'-', b'"', b'[', b'\n', 0xFF] {
            let mut changed = text.as_bytes().to_vec();
            changed[place] = byte;
            let _ = read(&changed);
        }
    }
}

#[test]
fn exr_and_hdr_environments_are_read_and_cleaned() {
    let folder = folder("[environment]\nfile = \"sky.exr\"\n");
    let texel = |x: usize, y: usize| match (x, y) {
        (1, 0) => (f32::NAN, -1.0, 2.0),
        (2, 0) => (3.0, 0.5, -0.25),
        _ => (x as f32, y as f32, 7.5),
    };
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 4, 2, texel).expect("EXR");
    let scene = load(folder.path(), "m.obj").expect("scene");
    let environment = scene.environment.as_ref().expect("environment");
    assert_eq!((environment.width, environment.height), (4, 2));
    assert_eq!(environment.radiance[7], Vec3::new(3.0, 1.0, 7.5));
    assert_eq!(environment.radiance[1], Vec3::ZERO);
    assert_eq!(environment.radiance[2], Vec3::new(3.0, 0.5, 0.0));
    assert!(scene.notes.iter().any(|n| n.instead.contains("2 texels")));
    assert_eq!(SceneProfile::of(&scene).environment, EnvironmentUse::Map);

    let file = std::fs::File::create(folder.path().join("sky.hdr")).expect("file");
    let pixels = [image::Rgb([1.0f32, 0.5, 0.25]); 8];
    image::codecs::hdr::HdrEncoder::new(file)
        .encode(&pixels, 4, 2)
        .expect("HDR");
    std::fs::write(
        folder.path().join("m.scene.toml"),
        "[environment]\nfile = \"sky.hdr\"\n",
    )
    .expect("file");
    let scene = load(folder.path(), "m.obj").expect("scene");
    assert_eq!(
        scene.environment.expect("environment").radiance,
        [Vec3::new(1.0, 0.5, 0.25); 8]
    );

    // Cut files are errors.
    let whole = std::fs::read(folder.path().join("sky.exr")).expect("file");
    std::fs::write(
        folder.path().join("m.scene.toml"),
        "[environment]\nfile = \"sky.exr\"\n",
    )
    .expect("file");
    for cut in (0..whole.len()).step_by(7) {
        std::fs::write(folder.path().join("sky.exr"), &whole[..cut]).expect("file");
        assert!(
            matches!(load(folder.path(), "m.obj"), Err(Error::Scene { at, .. }) if at.contains("environment.file")),
            "{cut}"
        );
    }
}

#[test]
fn unknown_files_are_refused_by_kind() {
    let error = scene::load("model.fbx").expect_err("kind").to_string();
    assert!(error.contains("\"fbx\"") && error.contains("gltf"), "{error}");
    assert!(matches!(scene::load("nowhere/model.glb"), Err(Error::Io { .. })));
    assert!(matches!(scene::load("builtin:nowhere"), Err(Error::Scene { .. })));
}

#[test]
fn every_generated_scene_loads_by_its_address_and_serializes_its_profile() {
    for entry in scene::builtin::catalogue() {
        let scene = scene::load(&format!("builtin:{}", entry.name)).expect(entry.name);
        let json = serde_json::to_value(SceneProfile::of(&scene)).expect("JSON");
        assert!(json["triangles"].as_u64().is_some_and(|n| n > 0));
        assert!(serde_json::to_string(entry).expect("JSON").contains(entry.name));
    }
}
