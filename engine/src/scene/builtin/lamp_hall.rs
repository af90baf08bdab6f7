//! A hall of desks, each under a lamp of its own that is far brighter there than all others.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Scene};

pub const LAMP_HALL: Entry = Entry {
    name: "lamp-hall",
    summary: "A hall of desks, each under a lamp of its own that outshines all others there.",
    parameters: &[
        Parameter::integer("n", "4096", 1, 1_000_000, "desks"),
        Parameter::choice(
            "lamps",
            "all",
            &["all", "one"],
            "whether all shine, or only the one that the camera looks at",
        ),
        Parameter::choice(
            "source",
            "panel",
            &["panel", "point", "spot"],
            "square panels, or lamps without extent: bare or with a shade",
        ),
        Parameter::choice(
            "walls",
            "no",
            &["yes", "no"],
            "walls up to the ceiling between neighbouring desks",
        ),
        Parameter::color("light", "4", 0.0, 1e6, "greatest intensity of a lamp, W/sr"),
    ],
    build,
};

/// Metres from one lamp to the next, of a desk's side, up to desks, lamps and the ceiling, and of a panel's side.
const PITCH: f32 = 4.0;
const DESK: f32 = 1.6;
const DESK_HEIGHT: f32 = 0.7;
const LAMP_HEIGHT: f32 = 1.5;
const CEILING: f32 = 3.0;
const PANEL: f32 = 0.2;
/// Cone of a shaded lamp, radians.
const SHADE: [f32; 2] = [0.5, 0.9];

fn build(values: &Values) -> Result<Scene> {
    let n = values.integer("n")?;
    let intensity = values.color("light")?;
    let source = values.word("source")?;
    let side = f64::from(n).sqrt().ceil() as u32;
    let half = side as f32 * PITCH / 2.0;
    let mut scene = Scene::default();
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::new(0.7, 0.68, 0.62)));
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.45, 0.3, 0.18)));
    scene.place(
        MeshBuilder::new("hall", plaster)
            .room(Vec3::new(-half, 0.0, -half), Vec3::new(half, CEILING, half))
            .build(),
    );
    let middles: Vec<Vec3> = (0..n)
        .map(|i| Vec3::new((i % side) as f32 + 0.5, 0.0, (i / side) as f32 + 0.5) * PITCH - Vec3::new(half, 0.0, half))
        .collect();
    // The desk in the middle.
    let seen = ((side / 2) * side + side / 2).min(n - 1) as usize;
    let all_shine = values.word("lamps")? == "all";
    let mut desks = MeshBuilder::new("desks", wood);
    for middle in &middles {
        let reach = Vec3::new(DESK, 0.0, DESK) / 2.0;
        let top = *middle + Vec3::Y * DESK_HEIGHT;
        desks.cuboid(top - reach - Vec3::Y * 0.05, top + reach);
    }
    scene.place(desks.build());
    if values.yes("walls")? {
        let mut walls = MeshBuilder::new("walls", plaster);
        for line in 1..side {
            let at = line as f32 * PITCH - half;
            walls.quad([
                Vec3::new(at, 0.0, -half),
                Vec3::new(at, 0.0, half),
                Vec3::new(at, CEILING, half),
                Vec3::new(at, CEILING, -half),
            ]);
            walls.quad([
                Vec3::new(-half, 0.0, at),
                Vec3::new(half, 0.0, at),
                Vec3::new(half, CEILING, at),
                Vec3::new(-half, CEILING, at),
            ]);
        }
        scene.place(walls.build());
    }
    let lamps = middles.iter().enumerate().filter(|(i, _)| all_shine || *i == seen);
    let lamps = lamps.map(|(_, middle)| *middle + Vec3::Y * LAMP_HEIGHT);
    if source == "panel" {
        let mut panel = Material::lambert("panels", Vec3::ZERO);
        panel.emission = intensity / (PANEL * PANEL);
        panel.double_sided = false;
        let panel = scene.add_material(panel);
        let mut panels = MeshBuilder::new("panels", panel);
        let (x, z) = (Vec3::X * PANEL / 2.0, Vec3::Z * PANEL / 2.0);
        for lamp in lamps {
            panels.quad([lamp - x - z, lamp + x - z, lamp + x + z, lamp - x + z]);
        }
        scene.place(panels.build());
    } else {
        for position in lamps {
            let kind = if source == "point" {
                LightKind::Point { position, intensity }
            } else {
                LightKind::Spot {
                    position,
                    direction: Vec3::NEG_Y,
                    intensity,
                    inner: SHADE[0],
                    outer: SHADE[1],
                }
            };
            scene.add_light("lamp", kind);
        }
    }
    let desk = (middles[seen] + Vec3::Y * DESK_HEIGHT).as_dvec3();
    let view = |name: &str, from: DVec3, fov: f32| Camera::look_at(name, desk + from, desk, DVec3::Y, fov.to_radians());
    scene.cameras.push(view("main", DVec3::new(0.8, 1.6, 1.7), 50.0));
    scene.cameras.push(view("hall", DVec3::new(1.9, 1.8, 1.9), 85.0));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn there_are_as_many_lamps_as_asked_for() {
        for (lamps, expected) in [("all", 30), ("one", 1)] {
            for source in ["panel", "point", "spot"] {
                let address = format!("builtin:lamp-hall?n=30&lamps={lamps}&source={source}");
                let profile = SceneProfile::of(&generate(&address).expect("scene"));
                let found = match source {
                    "panel" => profile.emissive_triangles as usize / 2,
                    "point" => profile.lights.point,
                    _ => profile.lights.spot,
                };
                assert_eq!(found, expected, "{address}");
            }
        }
    }
}
