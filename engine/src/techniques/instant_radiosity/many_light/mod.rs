//! Many lights on the surfaces of a deferred frame: direct light and one reflection more, of virtual lights that are new for each frame.
//!
//! Sources: A. Keller, "Instant Radiosity", SIGGRAPH 1997; A. Keller and W. Heidrich, "Interleaved Sampling", EGWR 2001; B. Segovia et al., "Non-interleaved Deferred
//! Shading of Interleaved Sample Patterns", Graphics Hardware 2006; S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR
//! 2007; C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §3.3 and §4.5 to §4.12.
//!
//! A frame is a sample of every pixel: walks from the lights leave a virtual light each where they first land; a G-buffer is rasterized; a kernel adds what is emitted and
//! what arrives directly, with two rays a pixel; the G-buffer is split into n × n tiles ([`Interleaving`]), each place gathers from its tile's subset of the virtual
//! lights, and sums go back to their pixels, where a filter averages those of neighbours on the same surface.
//!
//! # Bias
//!
//! Against the same light paths, `bounces=0..2` by lobes other than mirrors:
//!
//! - *Bound.* Light over edges that are shorter than the bound of the geometry term allows is left out in part, and nothing compensates it.
//! - *Filter.* The light of neighbours on the same surface is averaged, up to n/2 pixels away: contact shadows are as much softer, and of glossy surfaces so are highlights.
//! - *Visibility.* `none` lets light through everything. `maps` errs at borders of shadows by half a texel of what the virtual light sees, and as a whole about what is
//!   smaller than texels; light that a virtual light transmits through its own surface is in the shadow of that. `rays` adds no error.
//! - *Edges.* Rasterizers round corners to parts of a pixel (1/256 here): what is seen at a silhouette may be what lies behind, as far beside it, even where that is inside
//!   of a closed body.
//!
//! Transparent surfaces are opaque to all three, to eye and light, which for these light paths is right; what is there in part is refused.
//!
//! Without bound and filter and with rays a frame's expected picture is that of its light paths, except that numbers of lights which a tile has follow those which
//! have landed: an error of the order of one over the walks.
//!
//! Guarantees: deterministic in (seed, frame), on any number of threads; a submission is a bounded piece of work; pairs of pixels and lights are nowhere stored; what
//! settings or scene do not ask for costs no pass and no buffer.

mod card;
mod frame;
mod interleave;
mod kernels;
mod maps;
mod renderer;
mod settings;

pub(in crate::techniques) use card::CARD;
pub use interleave::Interleaving;
pub use renderer::{ManyLight, ManyLightCounts};
pub use settings::{ManyLightSettings, Visibility};
