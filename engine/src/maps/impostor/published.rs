//! Searches in distance impostors with the errors that they are known to have: what tests and experiments compare with.
//!
//! Source: a doctoral thesis on metals and reflections on graphics hardware, chapter 4, whose methods are those of L. Szirmay-Kalos, B. Aszódi, I. Lazányi and
//! M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3), 2005. It shows pictures; the numbers were computed for the
//! [rooms](super::room) here in double precision, independently of the engine, from exact distances and 37,600 rays a sphere.

use super::room::ShinySphere;
use super::{ImpostorSettings, SearchMethod};

/// Above it no crossing is passed over.
const ANY: f32 = 0.999;

/// What is known of a sphere's rays.
#[derive(Debug, Clone, Copy)]
pub struct Figures {
    /// Mean error of all rays, °.
    pub mean: Option<f64>,
    /// Mean error of those whose hit the map's place sees, °.
    pub seen: Option<f64>,
    /// Share of all rays below a degree, %.
    pub good: Option<f64>,
    /// The same of those whose hit the map's place sees, %.
    pub seen_good: Option<f64>,
    /// What 95 % of all rays are below, °.
    pub high: Option<f64>,
    /// The largest error, °.
    pub largest: Option<f64>,
}

impl Figures {
    /// Nothing.
    pub const NONE: Self = Self {
        mean: None,
        seen: None,
        good: None,
        seen_good: None,
        high: None,
        largest: None,
    };

    /// A mean error of all rays.
    pub const fn of_mean(mean: f64) -> Self {
        Self {
            mean: Some(mean),
            ..Self::NONE
        }
    }

    /// Means of all rays and of those whose hit is seen.
    const fn of_means(mean: f64, seen: f64) -> Self {
        Self {
            seen: Some(seen),
            ..Self::of_mean(mean)
        }
    }

    /// Mean, what 95 % are below, and the largest.
    const fn of_spread([mean, high, largest]: [f64; 3]) -> Self {
        Self {
            high: Some(high),
            largest: Some(largest),
            ..Self::of_mean(mean)
        }
    }

    const fn with_good(self, share: f64) -> Self {
        Self {
            good: Some(share),
            ..self
        }
    }

    const fn with_seen_good(self, share: f64) -> Self {
        Self {
            seen_good: Some(share),
            ..self
        }
    }
}

/// A search of a sphere's rays.
#[derive(Debug, Clone, Copy)]
pub struct Published {
    /// Whose rays.
    pub sphere: ShinySphere,
    /// How they are searched.
    pub settings: ImpostorSettings,
    /// In so many layers of surfaces.
    pub layers: u32,
    /// What is known of it.
    pub figures: Figures,
}

/// Spheres with the share of their rays whose hit the map's place sees, %, as published.
pub const SEEN_SHARES: [(ShinySphere, f64); 2] = [(ShinySphere::BOX, 98.1), (ShinySphere::P1, 69.8)];

/// Mean errors of rays that the first interface of the sphere [B](ShinySphere::B), of glass, refracts by the index 1.5, °.
pub const REFRACTED: [(SearchMethod, u32, f64); 3] = [
    (SearchMethod::Classical, 0, 17.28),
    (SearchMethod::SecantFromGuess, 0, 0.073),
    (SearchMethod::FalsePosition, 3, 0.004),
];

/// Radii of spheres that take the place of the room.
pub const PROXY_RADII: [f64; 3] = [1.0, 1.2, 1.5];
/// Mean errors of look-ups by these spheres, °.
pub const BY_PROXIES: [(ShinySphere, [f64; 3]); 2] = [
    (ShinySphere::B, [2.51, 1.24, 2.43]),
    (ShinySphere::C, [6.90, 3.43, 7.21]),
];

/// What tables call a search.
pub fn name(settings: &ImpostorSettings, layers: u32) -> String {
    let ImpostorSettings { method, steps, .. } = settings;
    match layers {
        1 if settings.tolerance == ANY => format!("{method} to the first crossing +{steps}"),
        1 => format!("{method} +{steps}"),
        _ => format!("{method} +{steps}, {layers} layers"),
    }
}

/// All that is searched.
pub fn searches() -> Vec<Published> {
    let mut all = first_crossings();
    all.extend(in_the_empty_room());
    all.extend(beside_obstacles());
    all.extend(behind_the_pillar());
    all.extend(in_layers());
    all
}

fn of(sphere: ShinySphere, method: SearchMethod, steps: u32, figures: Figures) -> Published {
    Published {
        sphere,
        settings: ImpostorSettings::of(method, steps),
        layers: 1,
        figures,
    }
}

/// Marches that take whatever crossing comes first.
pub fn first_crossings() -> Vec<Published> {
    let settings = ImpostorSettings {
        tolerance: ANY,
        ..ImpostorSettings::of(SearchMethod::March, 64)
    };
    [
        (
            ShinySphere::BOX,
            Figures::of_means(0.21, 0.017).with_good(98.1).with_seen_good(99.9),
        ),
        (
            ShinySphere::P1,
            Figures::of_means(7.5, 0.003).with_good(70.2).with_seen_good(100.0),
        ),
        (ShinySphere::P2, Figures::NONE),
    ]
    .map(|(sphere, figures)| Published {
        sphere,
        settings,
        layers: 1,
        figures,
    })
    .into()
}

/// Of the spheres A, B and C, in this order.
pub fn in_the_empty_room() -> Vec<Published> {
    use SearchMethod::{
        Classical, FalsePosition, FixedPoint, Hybrid, March, Mixed, Perpendicular, SecantFromGuess, SecantFromPoint,
    };
    const ROOM: [ShinySphere; 3] = [ShinySphere::A, ShinySphere::B, ShinySphere::C];
    // Mean, 95 % and largest.
    let guesses: [(SearchMethod, [[f64; 3]; 3]); 4] = [
        (
            Classical,
            [[9.75, 15.2, 17.4], [11.96, 18.6, 25.1], [30.88, 47.8, 52.8]],
        ),
        (
            Perpendicular,
            [[0.64, 1.71, 3.0], [0.87, 2.35, 3.4], [5.60, 18.7, 27.2]],
        ),
        (
            SecantFromPoint,
            [[0.95, 3.9, 5.2], [2.13, 6.1, 7.5], [17.9, 58.7, 71.3]],
        ),
        (
            SecantFromGuess,
            [[0.008, 0.06, 0.41], [0.010, 0.06, 0.55], [0.712, 4.5, 8.5]],
        ),
    ];
    let good_of_one_step = [100.0, 100.0, 79.3];
    let means: [(SearchMethod, u32, [f64; 3]); 12] = [
        (SecantFromPoint, 1, [0.241, 0.568, 21.1]),
        (SecantFromPoint, 3, [0.0, 0.0, 18.8]),
        (SecantFromPoint, 10, [0.0, 0.0, 18.7]),
        (SecantFromGuess, 1, [0.0, 0.0, 0.028]),
        (SecantFromGuess, 2, [0.0, 0.0, 0.005]),
        (SecantFromGuess, 3, [0.0, 0.0, 0.0]),
        (FalsePosition, 1, [0.029, 0.052, 4.08]),
        (FalsePosition, 3, [0.001, 0.001, 0.419]),
        (FalsePosition, 10, [0.0, 0.0, 0.005]),
        (Mixed, 1, [0.001, 0.001, 0.250]),
        (Mixed, 3, [0.0, 0.0, 0.045]),
        (Mixed, 10, [0.0, 0.0, 0.001]),
    ];
    // The secant from x keeps outliers in the corner.
    let far_in_the_corner = 134.0;
    let mut all = Vec::new();
    for (i, sphere) in ROOM.into_iter().enumerate() {
        for (method, figures) in guesses {
            let mut figures = Figures::of_spread(figures[i]);
            if method == SecantFromGuess {
                figures = figures.with_good(good_of_one_step[i]);
            }
            all.push(of(sphere, method, 0, figures));
        }
        for (method, steps, means) in means {
            let mut figures = Figures::of_mean(means[i]);
            if method == SecantFromPoint && steps == 10 && sphere == ShinySphere::C {
                figures.high = Some(far_in_the_corner);
            }
            all.push(of(sphere, method, steps, figures));
        }
        for steps in [0, 3, 10] {
            all.push(of(sphere, FixedPoint, steps, Figures::NONE));
        }
        all.push(of(sphere, Hybrid, 3, Figures::NONE));
        all.push(of(sphere, March, 64, Figures::NONE));
    }
    all
}

/// Beside a box, and beside a pillar.
pub fn beside_obstacles() -> Vec<Published> {
    use SearchMethod::{Classical, FalsePosition, Hybrid, Mixed, SecantFromGuess, SecantFromPoint};
    let (of_box, of_pillar) = (ShinySphere::BOX, ShinySphere::P1);
    // The secant from p leaves outliers beside the box.
    let secant = Figures {
        largest: Some(119.0),
        ..Figures::of_means(0.84, 0.65)
    };
    let all = [
        (
            of_box,
            Classical,
            0,
            Figures::of_means(21.1, 21.2).with_good(0.1).with_seen_good(0.1),
        ),
        (
            of_box,
            SecantFromGuess,
            0,
            Figures::of_means(1.95, 1.50).with_good(88.1).with_seen_good(89.7),
        ),
        (
            of_box,
            SecantFromPoint,
            10,
            Figures::of_means(1.73, 1.55).with_good(96.7).with_seen_good(98.2),
        ),
        (of_box, SecantFromGuess, 10, secant.with_good(97.1).with_seen_good(98.7)),
        (of_box, FalsePosition, 3, Figures::of_means(0.39, 0.19).with_good(93.9)),
        (
            of_box,
            FalsePosition,
            10,
            Figures::of_means(0.23, 0.042).with_good(97.9),
        ),
        (
            of_box,
            FalsePosition,
            48,
            Figures::of_means(0.23, 0.036).with_good(98.0),
        ),
        (of_box, Mixed, 3, Figures::of_means(0.40, 0.20).with_good(95.6)),
        (of_box, Mixed, 10, Figures::of_means(0.33, 0.136).with_good(97.6)),
        (of_box, Mixed, 48, Figures::of_means(0.32, 0.132).with_good(97.6)),
        (of_box, Hybrid, 3, Figures::NONE),
        (
            of_pillar,
            Classical,
            0,
            Figures::of_means(30.9, 23.8).with_good(0.0).with_seen_good(0.1),
        ),
        (
            of_pillar,
            SecantFromGuess,
            0,
            Figures::of_means(15.9, 1.19).with_good(57.5).with_seen_good(82.2),
        ),
        (
            of_pillar,
            SecantFromPoint,
            10,
            Figures::of_means(36.6, 33.9).with_good(47.2).with_seen_good(67.0),
        ),
        (
            of_pillar,
            SecantFromGuess,
            10,
            Figures::of_means(15.6, 0.024).with_good(70.2).with_seen_good(99.8),
        ),
        (of_pillar, FalsePosition, 3, Figures::of_means(8.3, 0.52)),
        (
            of_pillar,
            FalsePosition,
            10,
            Figures::of_means(7.9, 0.064).with_seen_good(97.4),
        ),
        (
            of_pillar,
            FalsePosition,
            48,
            Figures::of_means(7.8, 0.003).with_seen_good(100.0),
        ),
        (of_pillar, Mixed, 3, Figures::of_means(12.7, 0.35)),
        (of_pillar, Mixed, 10, Figures::of_means(11.9, 0.072)),
        (of_pillar, Mixed, 48, Figures::of_means(11.8, 0.003)),
        (of_pillar, Hybrid, 3, Figures::NONE),
    ];
    all.map(|(sphere, method, steps, figures)| of(sphere, method, steps, figures))
        .into()
}

/// Where the map's place sees nothing of the sphere. False position is the one whose guesses do not leave the room.
pub fn behind_the_pillar() -> Vec<Published> {
    use SearchMethod::{FalsePosition, Hybrid, Mixed};
    [
        (FalsePosition, Figures::of_means(37.2, 69.7)),
        (Mixed, Figures::of_means(31.1, 2.1)),
        (Hybrid, Figures::of_means(31.1, 2.1)),
    ]
    .map(|(method, figures)| of(ShinySphere::P2, method, 10, figures))
    .into()
}

/// Marches through maps of one to three layers.
pub fn in_layers() -> Vec<Published> {
    let shares = [
        (ShinySphere::P1, [69.9, 79.1, 98.7]),
        (ShinySphere::P2, [30.8, 50.3, 99.1]),
    ];
    let each = shares.into_iter().flat_map(|(sphere, shares)| {
        (1..).zip(shares).map(move |(layers, share)| Published {
            layers,
            ..of(sphere, SearchMethod::March, 64, Figures::NONE.with_good(share))
        })
    });
    each.collect()
}
