//! The source's nine scenes of photons in media: light, medium and settings as it has them, and what it found there.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.3.4, Tables 7.1 to 7.3. Scenes are stand-ins of about the same size, whose
//! addresses have its coefficients as parameters; how high fog stands in the courtyard, and how uneven it is, is ours. Its dampening was chosen by eye for its scenes, in metres; here it is the
//! default, a share of each scene's diagonal, unless a caller asks for the source's.

use clerestory::Result;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::kernel::KernelProfile;
use clerestory::techniques::photon_mapping::volume::VolumeKernel;

/// Light that is scattered once or twice before it is seen, on surfaces and in media: by photons that were not scattered before, or once.
pub const TWO_BOUNCES: &str = "bounces=1..2";
/// Multiples of a footprint's cube root.
const SPREAD: f32 = 3.0;
/// Unit of the source's dampening, m.
const LENGTH: f32 = 1.0;

/// How often photons that are stored were scattered before: the source has a dampening of its own for each of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depths {
    /// Once.
    One,
    /// Not at all, or once.
    UpToOne,
    /// Once or twice.
    OneAndTwo,
}

impl Depths {
    /// All, from the least to the deepest.
    pub const ALL: [Self; 3] = [Self::UpToOne, Self::One, Self::OneAndTwo];

    /// The numbers.
    pub fn words(self) -> &'static str {
        match self {
            Self::One => "1",
            Self::UpToOne => "0 and 1",
            Self::OneAndTwo => "1 and 2",
        }
    }

    /// Light paths that end in a medium and are seen of such photons.
    pub fn path_set(self) -> &'static str {
        match self {
            Self::One => "L.VE",
            Self::UpToOne => "LVE|L.VE",
            Self::OneAndTwo => "L.VE|L..VE",
        }
    }
}

/// A light and a medium as the source's table has them.
#[derive(Debug, Clone, Copy)]
pub struct PublishedMedium {
    /// A spot, else a point light.
    pub is_spot: bool,
    /// Absorption coefficient by band, 1/m; the average of an uneven medium.
    pub sigma_a: [f64; 3],
    /// Scattering coefficient by band, 1/m; the average of an uneven medium.
    pub sigma_s: [f64; 3],
    /// The same everywhere.
    pub is_even: bool,
    /// Schlick's eccentricity; forward is positive.
    pub k: f64,
}

/// A scene of the source with its settings.
pub struct Scenario {
    /// Its name.
    pub name: &'static str,
    /// Address of what stands in for it.
    pub scene: &'static str,
    /// Its light and its medium.
    pub medium: PublishedMedium,
    /// Photons of a frame.
    pub photons: u32,
    /// Greatest radius of kernels, m.
    pub greatest: f32,
    /// Dampening of photons that were scattered once before, up to once, and once or twice, m.
    pub dampening: [f32; 3],
    /// Collisions that it stores for the counts that follow.
    pub events: u64,
    /// Kernels that have the greatest radius, by the 85th neighbour and by footprints, %.
    pub clamped: [f64; 2],
    /// Kernels about a ray by the 85th neighbour, and what footprints change of it, %.
    pub kernels: [f64; 2],
    /// Whether a mirror throws light into the medium, which no path from the eye finds where lamps have no area.
    pub has_mirror: bool,
}

const COLOURED: [f64; 3] = [0.05, 0.3, 0.3];

const RING: Scenario = Scenario {
    name: "ring, point light",
    scene: "builtin:ring?segments=256&lift=0.3&sigma_a=0.01&sigma_s=0.5",
    medium: PublishedMedium {
        is_spot: false,
        sigma_a: [0.01; 3],
        sigma_s: [0.5; 3],
        is_even: true,
        k: 0.0,
    },
    photons: 1 << 20,
    greatest: 1.0,
    dampening: [2.5, 2.5, 1.5],
    events: 816_605,
    clamped: [0.0; 2],
    kernels: [766.87, 37.95],
    has_mirror: true,
};
const ATRIUM: Scenario = Scenario {
    name: "atrium, neutral",
    scene: "builtin:atrium?source=point&sigma_a=0.3&sigma_s=0.1",
    medium: PublishedMedium {
        sigma_a: [0.3; 3],
        sigma_s: [0.1; 3],
        ..RING.medium
    },
    greatest: 2.0,
    dampening: [6.0, 3.0, 3.0],
    events: 255_811,
    clamped: [0.11, 0.0],
    kernels: [1124.68, -15.21],
    has_mirror: false,
    ..RING
};
const CATHEDRAL: Scenario = Scenario {
    name: "cathedral, k = 0",
    scene: "builtin:cathedral?source=point&sigma_a=0.05&sigma_s=0.15&phase=schlick&g=0",
    medium: PublishedMedium {
        sigma_a: [0.05; 3],
        sigma_s: [0.15; 3],
        ..RING.medium
    },
    photons: 1 << 18,
    greatest: 3.0,
    dampening: [5.0, 3.0, 2.5],
    events: 362_540,
    clamped: [0.18, 0.0],
    kernels: [1290.03, -7.75],
    has_mirror: false,
};

/// All of them, in the source's order.
pub static SCENARIOS: [Scenario; 9] = [
    RING,
    Scenario {
        name: "ring, spot",
        scene: "builtin:ring?segments=256&lift=0.3&source=spot&sigma_a=0.01&sigma_s=0.5",
        medium: PublishedMedium {
            is_spot: true,
            ..RING.medium
        },
        dampening: [10.0, 10.0, 2.5],
        events: 894_416,
        kernels: [645.28, 18.56],
        ..RING
    },
    Scenario {
        name: "ring, spot, coloured",
        scene: "builtin:ring?segments=256&lift=0.3&source=spot&sigma_a=0.01&sigma_s=0.5,0.01,0.01",
        medium: PublishedMedium {
            is_spot: true,
            sigma_s: [0.5, 0.01, 0.01],
            ..RING.medium
        },
        dampening: [10.0, 10.0, 2.5],
        events: 818_157,
        kernels: [599.85, 11.59],
        ..RING
    },
    ATRIUM,
    Scenario {
        name: "atrium, coloured",
        scene: "builtin:atrium?source=point&sigma_a=0.05,0.3,0.3&sigma_s=0.1",
        medium: PublishedMedium {
            sigma_a: COLOURED,
            ..ATRIUM.medium
        },
        events: 269_959,
        kernels: [1145.64, -12.23],
        ..ATRIUM
    },
    Scenario {
        name: "atrium, uneven",
        scene: "builtin:atrium?source=point&sigma_a=0.05,0.3,0.3&sigma_s=0.1&density=waves",
        medium: PublishedMedium {
            sigma_a: COLOURED,
            is_even: false,
            ..ATRIUM.medium
        },
        dampening: [10.0, 5.0, 5.0],
        events: 258_533,
        clamped: [0.12, 0.02],
        kernels: [728.14, 22.30],
        ..ATRIUM
    },
    Scenario {
        name: "cathedral, k = 0.5",
        scene: "builtin:cathedral?source=point&sigma_a=0.05&sigma_s=0.15&phase=schlick&g=0.5",
        medium: PublishedMedium {
            k: 0.5,
            ..CATHEDRAL.medium
        },
        dampening: [7.0, 4.0, 3.0],
        events: 355_852,
        clamped: [0.19, 0.0],
        kernels: [1298.92, 3.97],
        ..CATHEDRAL
    },
    CATHEDRAL,
    Scenario {
        name: "cathedral, k = -0.5",
        scene: "builtin:cathedral?source=point&sigma_a=0.05&sigma_s=0.15&phase=schlick&g=-0.5",
        medium: PublishedMedium {
            k: -0.5,
            ..CATHEDRAL.medium
        },
        events: 369_746,
        kernels: [1287.44, -3.51],
        ..CATHEDRAL
    },
];

/// The scenario of a name.
pub fn by_name(name: &str) -> Option<&'static Scenario> {
    SCENARIOS.iter().find(|scenario| scenario.name == name)
}

impl Scenario {
    /// The source's dampening, m.
    pub fn dampening(&self, depths: Depths) -> f32 {
        let [one, up_to_one, one_and_two] = self.dampening;
        match depths {
            Depths::One => one,
            Depths::UpToOne => up_to_one,
            Depths::OneAndTwo => one_and_two,
        }
    }

    /// The source's settings for some light paths, with a share of its photons, whose kernels are wider than its own by the cube root of it, and the default dampening.
    ///
    /// # Errors
    /// [`Error::Setting`](clerestory::Error::Setting) for paths that are none.
    pub fn settings(&self, paths: &str, depths: Depths, share: u32) -> Result<PhotonSettings> {
        Ok(PhotonSettings {
            path_set: paths.parse()?,
            photons: self.photons / share,
            direct_photons: depths == Depths::UpToOne,
            profile: KernelProfile::Uniform,
            volume_kernel: VolumeKernel::Footprint,
            volume_radius: self.greatest,
            volume_spread: SPREAD,
            ..PhotonSettings::default()
        })
    }

    /// Such settings with a dampening in metres, as the source has it.
    ///
    /// # Errors
    /// As [`Self::settings`].
    pub fn settings_dampened(&self, paths: &str, depths: Depths, share: u32, metres: f32) -> Result<PhotonSettings> {
        Ok(PhotonSettings {
            unit_length: LENGTH,
            volume_dampening: metres,
            ..self.settings(paths, depths, share)?
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clerestory::transport::PathSet;
    use clerestory::transport::bsdf::{LOBE_DIFFUSE, LOBE_REFLECTION};
    use clerestory::transport::path_set::LOBE_VOLUME;

    #[test]
    fn paths_of_depths_end_in_media_behind_so_many_scatterings() {
        for (depths, lengths) in [
            (Depths::One, 2..=2),
            (Depths::UpToOne, 1..=2),
            (Depths::OneAndTwo, 2..=3),
        ] {
            let set: PathSet = depths.path_set().parse().unwrap();
            for length in 1..5usize {
                let surfaces = (1..length).map(|_| LOBE_DIFFUSE & LOBE_REFLECTION);
                let events: Vec<u32> = surfaces.chain([LOBE_VOLUME]).collect();
                assert_eq!(set.contains(&events), lengths.contains(&length), "{depths:?} {length}");
            }
        }
    }
}
