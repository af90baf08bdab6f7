//! What an automatic choice ([`plan`](mod@crate::plan)) must know of a technique beside what its pilot pictures show.

use crate::Result;
use crate::gpu::Caps;
use crate::scene::{Light, SceneProfile};
use crate::settings::Settings;
use crate::transport::PathSet;

use super::FrameTarget;

/// What holds of a technique before it has rendered anything. [`Foresight::PLAIN`] claims nothing.
#[derive(Debug, Clone, Copy)]
pub struct Foresight {
    /// Refuses a picture of a size that the device's limits rule out, as [`Card::create`](super::Card::create) would. Pilots are small and do not meet them.
    pub fits: fn(&Caps, [u32; 2]) -> Result<()>,
    /// What of these light paths its pictures of a scene with these lights lack, however many samples they have, in words that follow
    /// "it misses"; `None` where they lack none.
    pub misses: fn(&SceneProfile, &[Light], &PathSet) -> Result<Option<String>>,
    /// Settings of a pilot picture of the second size, in place of these ones of a picture of the first, so that what all pixels share is no more of the pilot's than
    /// of the picture's.
    pub pilot: fn(&Settings, [u32; 2], [u32; 2]) -> Result<Settings>,
    /// How its error falls, with these settings.
    pub law: fn(&Settings) -> Result<Law>,
}

/// How a technique's error falls with its samples, by theory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// Its variance falls as samples^(−slope) or faster: 1 for independent samples, less where kernels shrink.
    pub slope: f64,
    /// Its squared bias falls as samples^(−exponent), where pilots do not show how; 0 where it stays, or where nothing is known. Only consistent techniques are asked.
    pub bias_exponent: f64,
    /// Samples per pixel, 1 or more, that are taken before anything shrinks: pictures with no more than these have the same bias.
    pub samples_a_pass: u32,
    /// Samples per pixel from which on its error falls so: pictures of fewer do not show how.
    pub samples_least: u32,
    /// Neighbouring pixels share their noise, as under a kernel, so that what is bright in one picture alone is not rare light that pixels around may
    /// get, too.
    pub shares_noise: bool,
}

impl Law {
    /// Independent samples, and a bias that stays.
    pub const INDEPENDENT: Self = Self {
        slope: 1.0,
        bias_exponent: 0.0,
        samples_a_pass: 1,
        samples_least: 1,
        shares_noise: false,
    };
}

impl Foresight {
    /// Pictures of every size, with every path of the path set; independent samples.
    pub const PLAIN: Self = Self {
        fits: |_, _| Ok(()),
        misses: |_, _, _| Ok(None),
        pilot: |settings, _, _| Ok(settings.clone()),
        law: |_| Ok(Law::INDEPENDENT),
    };

    /// As [`PLAIN`](Self::PLAIN), for a [`FrameMethod`](super::FrameMethod): an [`Accumulated`](super::Accumulated) frame is one storage buffer.
    pub const FRAMES: Self = Self {
        fits: frame_fits,
        ..Self::PLAIN
    };
}

/// Refuses frames that are larger than a storage buffer.
pub(super) fn frame_fits(caps: &Caps, size: [u32; 2]) -> Result<()> {
    caps.check_storage("frame", FrameTarget::bytes(size))
}
