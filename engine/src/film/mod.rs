//! Floor 2: pictures. Accumulation, files, tone curves, error metrics.

pub mod accumulate;
pub mod atomic;
pub mod exr;
pub mod gpu_film;
pub mod hdr;
pub mod metrics;
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
