//! Nodes of kd-trees: some by name, and all of a grid.

use clerestory::accel::kd::bounds::Bounds;
use glam::DVec3;

const CUBE: DVec3 = DVec3::ONE;
const ROOM: DVec3 = DVec3::new(10.0, 6.0, 3.0);

/// A node of a scene that begins at the origin, and its exact probability by 4·10⁶ samples, ±2·10⁻⁴.
pub struct Node {
    /// With its scene.
    pub name: &'static str,
    /// The scene's upper corner.
    pub scene: DVec3,
    /// Its lower corner.
    pub lower: [f64; 3],
    /// Its upper corner.
    pub upper: [f64; 3],
    /// The probability by samples.
    pub sampled: f64,
}

const fn node(name: &'static str, scene: DVec3, lower: [f64; 3], upper: [f64; 3], sampled: f64) -> Node {
    Node {
        name,
        scene,
        lower,
        upper,
        sampled,
    }
}

/// All.
pub const NODES: [Node; 12] = [
    node("cube, all", CUBE, [0.0; 3], [1.0; 3], 1.0),
    node("cube, x < 0.5", CUBE, [0.0; 3], [0.5, 1.0, 1.0], 0.6240),
    node("cube, x < 0.1", CUBE, [0.0; 3], [0.1, 1.0, 1.0], 0.2605),
    node("cube, an eighth in a corner", CUBE, [0.0; 3], [0.5; 3], 0.2180),
    node("cube, half-sized in the middle", CUBE, [0.25; 3], [0.75; 3], 0.2683),
    node("cube, tenth-sized in the middle", CUBE, [0.45; 3], [0.55; 3], 0.00971),
    node("cube, tenth-sized in a corner", CUBE, [0.0; 3], [0.1; 3], 0.00412),
    node("cube, flat at x = 0.5", CUBE, [0.5, 0.0, 0.0], [0.5, 1.0, 1.0], 0.2480),
    node("cube, flat at x = 0", CUBE, [0.0; 3], [0.0, 1.0, 1.0], 0.16667),
    node(
        "10 × 6 × 3, unit cube in the middle",
        ROOM,
        [4.5, 2.5, 1.0],
        [5.5, 3.5, 2.0],
        0.0277,
    ),
    node("10 × 6 × 3, left half", ROOM, [0.0; 3], [5.0, 6.0, 3.0], 0.5719),
    node(
        "10 × 6 × 3, floor slab z < 0.3",
        ROOM,
        [0.0; 3],
        [10.0, 6.0, 0.3],
        0.3576,
    ),
];

/// Scenes of the grid.
pub const SCENES: [(&str, DVec3); 2] = [("cube", CUBE), ("10 × 6 × 3", ROOM)];
/// All boxes with corners on a grid over a scene, flat ones left out.
pub fn grid(scene: DVec3, cells: u32) -> Vec<Bounds> {
    let ranges: Vec<[f64; 2]> = (0..cells)
        .flat_map(|from| (from + 1..=cells).map(move |to| [from, to].map(|at| f64::from(at) / f64::from(cells))))
        .collect();
    let mut all = Vec::with_capacity(ranges.len().pow(3));
    for x in &ranges {
        for y in &ranges {
            for z in &ranges {
                let corner = |side: usize| scene * DVec3::new(x[side], y[side], z[side]);
                all.push(Bounds {
                    lower: corner(0),
                    upper: corner(1),
                });
            }
        }
    }
    all
}
