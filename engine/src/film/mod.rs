//! Floor 2: pictures. Accumulation, files, tone curves, error metrics.
//!
//! # What safe calls can do to memory
//!
//! No code here is `unsafe`. What reaches code that is:
//!
//! | call | what holds |
//! |---|---|
//! | [`GpuFilm`]: `new`, `clear`, `picture`, `record_…`, `display` | bands are at most 2²⁰ pixels and have buffers of their own; a host's buffers are compared with the picture's size; all else is [`gpu`](crate::gpu)'s to check |
//! | [`compare`], [`metrics::flip_map`] | FLIP is C++ that trusts its input: sizes are equal and at most 715 million pixels, colours are bytes, pixels per degree are in [`PIXELS_PER_DEGREE`] |
//! | [`mod@exr`], [`hdr`], [`png`] | the decoders are Rust's |
//! | [`Picture`], [`Accumulator`], tone curves, the z-test | slices and vectors, whose bounds Rust checks |

pub mod accumulate;
pub mod exr;
pub mod gpu_film;
pub mod hdr;
pub mod mark;
pub mod metrics;
mod photographic;
pub mod picture;
pub mod pixel_format;
pub mod png;
pub mod tone;
pub mod z_test;

pub use accumulate::{Accumulator, TwoFloat};
pub use gpu_film::{FilmBand, GpuFilm, Step};
pub use metrics::{CompareOptions, ErrorReport, PIXELS_PER_DEGREE, compare};
pub use picture::{Layer, Metadata, NonFinite, NonFiniteSamples, Picture};
pub use pixel_format::PixelFormat;
pub use tone::{ToneCurve, ToneMap};
pub use z_test::{ZTest, z_test};
