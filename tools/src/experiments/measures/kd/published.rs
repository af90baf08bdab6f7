//! What the source says of kd-trees over its five scenes, by their names.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, tables 4.1 to 4.10. Changes are in per cent.

/// A figure of each scene.
type Table<P> = [(&'static str, P); 5];

/// What it says of a scene; nothing of scenes that have no counterpart.
pub fn of_source<P>(published: &'static Table<P>, counterpart: &str) -> Option<&'static P> {
    let row = published.iter().find(|(name, _)| *name == counterpart);
    row.map(|(_, published)| published)
}

/// Ways through a tree (tables 4.5 and 4.6).
pub struct Ways {
    /// Inner nodes per ray with a stack.
    pub visits: f64,
    /// What the other schemes change in them.
    pub changes: [f64; 4],
    /// What they change in frames a second.
    pub speeds: [f64; 4],
}

const fn ways(visits: f64, changes: [f64; 4], speeds: [f64; 4]) -> Ways {
    Ways {
        visits,
        changes,
        speeds,
    }
}

/// Of flags alone, with push-down, with a short stack, with both.
pub static WAYS: Table<Ways> = [
    ("Scene 6", ways(7.31, [35.7, 21.1, 0.0, 0.0], [-5.3, -2.6, -1.3, -2.5])),
    (
        "Sponza",
        ways(29.81, [136.7, 97.1, 0.3, 0.2], [-37.1, -30.6, -8.7, -12.2]),
    ),
    (
        "Sibenik",
        ways(37.63, [151.5, 107.2, 0.8, 0.8], [-43.5, -35.8, -10.2, -13.8]),
    ),
    (
        "Fairy",
        ways(37.43, [182.7, 98.2, 0.6, 0.6], [-41.6, -29.8, -11.6, -14.9]),
    ),
    (
        "Conference",
        ways(19.57, [108.1, 59.4, 0.3, 0.3], [-18.1, -11.4, -4.6, -7.2]),
    ),
];

/// Caches (tables 4.8 and 4.10).
pub struct Caches {
    /// Per ray without any: inner nodes fetched, entries of the stack accessed, bytes.
    pub none: [f64; 3],
    /// What the other forms change in nodes fetched.
    pub nodes: [f64; 6],
    /// In entries of the stack.
    pub entries: [f64; 6],
    /// In bytes.
    pub bytes: [f64; 6],
    /// In frames a second.
    pub speed: [f64; 6],
}

/// By the forms of [`KdCaches::COMPARED`](clerestory::accel::kd::KdCaches::COMPARED).
pub static CACHES: Table<Caches> = [
    (
        "Scene 6",
        Caches {
            none: [7.31, 2.01, 74.51],
            nodes: [-96.4, 0.0, 16.0, -96.4, -93.2, -94.3],
            entries: [0.0, -88.7, 2.2, -88.7, -88.1, 2.2],
            bytes: [-75.6, -19.1, 13.0, -94.7, -92.1, -73.5],
            speed: [2.4, 3.8, -6.2, 6.1, 2.5, -3.2],
        },
    ),
    (
        "Sponza",
        Caches {
            none: [29.81, 12.31, 336.95],
            nodes: [-63.8, 0.0, 13.6, -63.8, -49.9, -52.0],
            entries: [0.0, -63.7, 8.9, -63.7, -48.1, 8.9],
            bytes: [-45.2, -18.6, 12.2, -63.8, -49.4, -34.2],
            speed: [-0.3, 1.3, -29.2, 2.3, -4.3, -29.1],
        },
    ),
    (
        "Sibenik",
        Caches {
            none: [37.63, 14.46, 416.72],
            nodes: [-60.9, 0.0, 11.1, -60.9, -43.8, -49.1],
            entries: [0.0, -60.4, 5.0, -60.4, -37.1, 5.0],
            bytes: [-44.0, -16.8, 9.4, -60.8, -41.9, -34.1],
            speed: [-1.0, 1.2, -27.1, 1.8, -6.0, -27.2],
        },
    ),
    (
        "Fairy",
        Caches {
            none: [37.43, 16.96, 435.06],
            nodes: [-62.6, 0.0, 13.0, -62.6, -52.5, -53.4],
            entries: [0.0, -68.6, 4.1, -68.6, -48.7, 4.1],
            bytes: [-43.1, -21.4, 10.2, -64.5, -51.3, -35.5],
            speed: [-1.5, 1.5, -51.7, 1.0, -5.9, -52.5],
        },
    ),
    (
        "Conference",
        Caches {
            none: [19.57, 6.69, 210.03],
            nodes: [-77.7, 0.0, 12.5, -77.7, -64.3, -68.9],
            entries: [0.0, -74.1, 5.8, -74.1, -59.7, 5.8],
            bytes: [-57.9, -18.9, 10.8, -76.8, -63.2, -49.9],
            speed: [-0.1, 0.4, -42.1, 0.8, -2.9, -42.0],
        },
    ),
];

/// Trees by heuristic (tables 4.1 to 4.4).
pub struct Trees {
    /// Inner nodes per ray in trees by surface area.
    pub visits: f64,
    /// Triangles per ray whose plane is tested there.
    pub tests: f64,
    /// Inner nodes of the tree.
    pub nodes: f64,
    /// What 26 regions change.
    pub regions: Changes,
    /// What SIROH changes.
    pub siroh: Changes,
}

/// What a heuristic changes.
pub struct Changes {
    /// Of inner nodes per ray.
    pub visits: f64,
    /// Of triangles per ray.
    pub tests: f64,
    /// Of the tree's inner nodes, where the source says it.
    pub nodes: Option<f64>,
    /// Of the time of a build on its two processors, where it says it.
    pub build: Option<[f64; 2]>,
    /// Of frames a second (its code base I).
    pub speed: f64,
}

const fn regions(visits: f64, tests: f64, speed: f64) -> Changes {
    Changes {
        visits,
        tests,
        nodes: None,
        build: None,
        speed,
    }
}

const fn siroh(visits: f64, tests: f64, nodes: f64, build: [f64; 2], speed: f64) -> Changes {
    Changes {
        visits,
        tests,
        nodes: Some(nodes),
        build: Some(build),
        speed,
    }
}

const fn trees([visits, tests, nodes]: [f64; 3], regions: Changes, siroh: Changes) -> Trees {
    Trees {
        visits,
        tests,
        nodes,
        regions,
        siroh,
    }
}

/// By surface area, and what other heuristics change.
pub static TREES: Table<Trees> = [
    (
        "Scene 6",
        trees(
            [9.68, 7.59, 2801.0],
            regions(-24.9, -15.3, 7.5),
            siroh(-25.2, -14.3, 1.5, [7.4, 11.4], 7.0),
        ),
    ),
    (
        "Sponza",
        trees(
            [30.83, 7.95, 207_425.0],
            regions(-0.5, 1.1, 1.9),
            siroh(-4.3, 25.5, -1.0, [5.8, 6.2], 0.0),
        ),
    ),
    (
        "Sibenik",
        trees(
            [40.44, 5.06, 192_667.0],
            regions(-5.8, -11.0, 2.0),
            siroh(-5.6, -10.5, -0.3, [2.3, -11.5], 2.1),
        ),
    ),
    (
        "Fairy",
        trees(
            [41.30, 8.09, 788_603.0],
            regions(5.5, -5.7, 1.3),
            siroh(-1.1, -3.9, 1.2, [13.0, 27.7], 2.7),
        ),
    ),
    (
        "Conference",
        trees(
            [23.56, 12.99, 611_297.0],
            regions(-13.0, -21.4, 5.1),
            siroh(-18.6, -17.4, 0.0, [7.6, 4.5], 4.2),
        ),
    ),
];

/// Frames a second of persistent threads over those of one thread per ray, trees by surface area (table 4.1).
pub static THREADS: Table<f64> = [
    ("Scene 6", 341.8 / 382.2),
    ("Sponza", 215.6 / 99.6),
    ("Sibenik", 189.4 / 101.0),
    ("Fairy", 144.1 / 75.9),
    ("Conference", 171.0 / 71.9),
];

/// What SIROH changes in frames a second of other tracers: the source's code base II (table 4.1), and RT² (table 4.2 (a)).
pub static OTHER_TRACERS: Table<[f64; 2]> = [
    ("Scene 6", [14.9, 8.5]),
    ("Sponza", [-0.8, -3.9]),
    ("Sibenik", [2.7, 4.2]),
    ("Fairy", [3.4, 0.4]),
    ("Conference", [0.5, 5.1]),
];

/// And of Radius-CUDA, of the one scene that it renders: with the light inside, and outside (table 4.2 (b)).
pub const RADIUS: (&str, [f64; 2]) = ("Fairy", [1.7, -3.8]);
