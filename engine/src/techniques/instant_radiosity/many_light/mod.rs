//! Many lights on the surfaces of a deferred frame: direct light and one reflection more, or several, of virtual lights that are new for each frame
//! or kept from frame to frame.
//!
//! Sources: A. Keller, "Instant Radiosity", SIGGRAPH 1997; A. Keller and W. Heidrich, "Interleaved Sampling", EGWR 2001; B. Segovia et al., "Non-interleaved Deferred
//! Shading of Interleaved Sample Patterns", Graphics Hardware 2006; S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", EGSR
//! 2007; C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005; T. Ritschel et al., "Imperfect Shadow Maps for Efficient Computation of Indirect
//! Illumination", SIGGRAPH Asia 2008; C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §3.3 and §4.5 to §4.12.
//!
//! A frame is a sample of every pixel: walks from the lights, or points on reflective shadow maps of them, leave a virtual light each where they first land (and at each landing further on, where the path set has more than two bounces), or those of points and spots are
//! kept from frame to frame ([`incremental`](crate::techniques::instant_radiosity::incremental)); a G-buffer is rasterized; a kernel adds what is emitted and
//! what arrives directly, with two rays a pixel; the G-buffer is split into n × n tiles ([`Interleaving`]), each place gathers from its tile's subset of the virtual
//! lights, and sums go back to their pixels, where a filter averages those of neighbours on the same surface; a [`history`] blends them with those of the frame before, for
//! frames that are shown one by one. On a film frames with a history are no independent samples: their mean is the same where nothing moves, but its variance is more than it says.
//!
//! # A technique of steps
//!
//! It is a [`Technique`](crate::techniques::Technique) with steps of its own and no [`FrameMethod`](crate::techniques::FrameMethod), which records a whole frame into a host's command buffer and waits for nothing. A frame here
//! waits for the device: how many virtual lights have landed is read back between the walks and the gather, which is recorded for as many; what the lights' views are drawn from, and whether they reflect anything,
//! before their lights; whether any place has lights left, or a ray that a quota has stopped, between sweeps. A host calls [`step`](ManyLight::step) and takes the picture from [`display`](ManyLight::display) or [`picture`](ManyLight::picture).
//!
//! # Bias
//!
//! Against the same light paths, `bounces=0..2`, or up to more, by lobes other than mirrors:
//!
//! - *Bound.* Light over edges that are shorter than the bound of the geometry term allows is left out in part, and nothing compensates it.
//! - *Filter.* The light of neighbours on the same surface is averaged, up to n/2 pixels away: contact shadows are as much softer, and of glossy surfaces so are highlights.
//! - *Visibility.* `none` lets light through everything. `maps` errs at borders of shadows by half a texel of what the virtual light sees, and as a whole about what is
//!   smaller than texels; shadows begin a texel's diagonal off what casts them, and what is nearer to a light than 2⁻¹⁴ of the scene's reach casts none; light that a
//!   virtual light transmits through its own surface is in the shadow of that. `imperfect` errs so, and by what its points miss or cover too much
//!   ([`splat_atlas`](crate::raster::splat_atlas)), and has cut-outs opaque. `rays` adds no error.
//! - *Placement.* By walks exact. By reflective shadow maps what a texel's middle meets stands for all of the texel, so that light ends a texel from where it should.
//!   Lights that are kept stand for all directions of their lamps in every frame: a picture of many frames has the error of one, of the order of one over the lights.
//!   Lights that chains have chosen are weighted by one over a measured power, and chains are finite: an error of the order of one over the pixels that measure it, and of one over the lights.
//! - *Discs.* What is gathered from texels in discs comes through everything, and what lies beyond a disc or the view that it is in is missing; the published weight is off
//!   by what the light falls or grows over a disc.
//! - *Reservoirs.* None of their own: what neighbours keep is weighted by the chance that each pixel had to keep it.
//! - *History.* Light that is blended with that of the frame before lags behind what changes: of a step 1 - cᵏ are there after k frames where the confidence stays c. Noise lowers the
//!   confidence, too, by bright frames and dark ones alike, and what is bounded for a history is missing. Where pixels move over surfaces light is blurred along these by parts of a pixel a frame.
//!   Of an object that was moved ([`GpuScene::move_object`](crate::transport::GpuScene::move_object)) light is looked up where its points are now: it follows what slides along its own
//!   surface, lags where that rises or turns, and is new where it does so by more in a frame than `filter_plane` and `filter_normal` let neighbours differ. Shadows of what moves lag as all light does.
//! - *Edges.* Rasterizers round corners to parts of a pixel (1/256 here): what is seen at a silhouette may be what lies behind, as far beside it, even where that is inside
//!   of a closed body.
//!
//! Transparent surfaces are opaque to all three, to eye and light, which for these light paths is right; what is there in part is refused.
//!
//! Without bound and filter and with rays a frame's expected picture is that of its light paths, except that numbers of lights which a tile has follow those which
//! have landed: an error of the order of one over the walks. Virtual lights of several bounces lie one bounce behind the other; a tile's part of them changes from frame to
//! frame, so that each has all of them over as many frames as there are tiles.
//!
//! Guarantees: deterministic in (seed, frame), where lights are kept in where their lamps have been, and with a history in all frames since it began, on any number of threads; a submission is a bounded piece of work; pairs of pixels and lights are nowhere stored; what
//! settings or scene do not ask for costs no pass and no buffer.

mod card;
mod discs;
mod exact_maps;
mod frame;
pub mod history;
mod imperfect_maps;
mod interleave;
mod kept;
mod kernels;
mod maps;
mod metropolis;
mod past;
mod records;
mod reflective;
mod reflective_map;
mod renderer;
mod reservoirs;
mod settings;

pub(in crate::techniques) use card::CARD;
pub use interleave::Interleaving;
pub use reflective_map::{PixelLight, ReflectiveMap};
pub use renderer::{ManyLight, ManyLightCounts};
pub use settings::{Gathering, ManyLightSettings, Placement, RsmSequence, Visibility};
