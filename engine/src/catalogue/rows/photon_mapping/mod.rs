//! Rows of the document on photon mapping (`PM-`), one file a topic.

mod kernels;
mod maps;
mod media;
mod photons;
mod rendering;
mod trees;

use crate::catalogue::Row;

pub(super) const FILES: [&[Row]; 6] = [
    kernels::ROWS,
    trees::ROWS,
    maps::ROWS,
    photons::ROWS,
    media::ROWS,
    rendering::ROWS,
];
